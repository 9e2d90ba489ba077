//! EXR in memory, by the crate `exr`.

use super::metadata::{Metadata, REC709, SOFTWARE, Value, Window};
use super::picture::{Picture, Samples};
use super::{Failure, plausible_pixels, room};
use crate::math::Rgb;
use crate::render::Image;
use exr::block::reader::ChunksReader;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::image::{Encoding, Image as Exr, Layer, SpecificChannels};
use exr::meta::attribute::{AttributeValue, Chromaticities, EnvironmentMap, SampleType, Text};
use exr::meta::header::{Header, ImageAttributes};
use exr::prelude::{Blocks, Compression, IntegerBounds, IntoSample, LayerAttributes, LineOrder, Vec2, WritableImage};
use half::f16;
use std::io::Cursor;

/// Scan lines, ZIP in blocks of 16.
const ENCODING: Encoding =
    Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };

/// The bytes of a file with channels R, G, B and, if there is one, A; the display window is the frame, from (0, 0).
pub(super) fn encode(picture: &Picture, metadata: &Metadata) -> Result<Vec<u8>, Failure> {
    match &picture.samples {
        Samples::Half(samples) => encode_samples(picture, samples, metadata, f16::from_f32),
        Samples::Float(samples) => encode_samples(picture, samples, metadata, |x| x),
        Samples::Bytes(_) => Err(Failure::Unsupported("EXR has no 8-bit samples".to_owned())),
    }
}

fn encode_samples<T>(
    picture: &Picture,
    samples: &[T],
    metadata: &Metadata,
    convert: fn(f32) -> T,
) -> Result<Vec<u8>, Failure>
where
    T: IntoSample + Copy + Sync,
{
    let (width, height) = (picture.width as usize, picture.height as usize);
    let place = |at: Vec2<usize>| at.y() * width + at.x();
    let pixel = |at: Vec2<usize>| {
        let i = 3 * place(at);
        (samples[i], samples[i + 1], samples[i + 2])
    };
    let Window { data, frame } = metadata.window(picture.width, picture.height);
    let mut attributes = LayerAttributes {
        software_name: Some(text(SOFTWARE)),
        // In a frame whose sides fit, which `Metadata::check` demands.
        layer_position: Vec2(data.x as i32, data.y as i32),
        ..LayerAttributes::default()
    };
    for (name, value) in metadata.attributes() {
        let value = match value {
            Value::Text(value) => AttributeValue::Text(text(&value)),
            Value::Int(value) => AttributeValue::I32(value),
            Value::Float(value) => AttributeValue::F32(value),
        };
        attributes.other.insert(text(&name), value);
    }
    let with_alpha = |at: Vec2<usize>| {
        let (r, g, b) = pixel(at);
        (r, g, b, convert(picture.alpha[place(at)]))
    };
    let (size, mut file) = ((width, height), Cursor::new(Vec::new()));
    if picture.alpha.is_empty() {
        let layer = Layer::new(size, attributes, ENCODING, SpecificChannels::rgb(pixel));
        framed(layer, frame).write().non_parallel().to_buffered(&mut file)
    } else {
        let layer = Layer::new(size, attributes, ENCODING, SpecificChannels::rgba(with_alpha));
        framed(layer, frame).write().non_parallel().to_buffered(&mut file)
    }
    .map_err(codec)?;
    let mut file = file.into_inner();
    sort_attributes(&mut file).ok_or_else(|| Failure::Codec("the encoder made no EXR header".to_owned()))?;
    Ok(file)
}

/// An image of one layer in a display window of that size.
fn framed<C>(layer: Layer<C>, [width, height]: [u32; 2]) -> Exr<Layer<C>> {
    let window = IntegerBounds::from_dimensions(Vec2(width as usize, height as usize));
    let [red, green, blue, white] = REC709.map(|(x, y)| Vec2(x, y));
    let mut attributes = ImageAttributes::new(window);
    attributes.chromaticities = Some(Chromaticities { red, green, blue, white });
    Exr { attributes, layer_data: layer }
}

/// UTF-8 as it is, as OpenEXR does; NUL has been refused before.
fn text(utf8: &str) -> Text {
    Text::from_slice_unchecked(utf8.as_bytes())
}

/// Puts the header's attributes into the order of their names.
///
/// `exr` keeps them in a hash map with a random order: without this, equal images would be unequal
/// files. An attribute is `name NUL type NUL size:i32 value`; an empty name ends the header (OpenEXR
/// file layout, "Header"). Sorting moves no byte behind the header.
fn sort_attributes(file: &mut [u8]) -> Option<()> {
    const START: usize = 8; // magic number, version
    let mut attributes = Vec::new();
    let mut rest = file.get(START..)?;
    while *rest.first()? != 0 {
        let name = rest.iter().position(|&b| b == 0)?;
        let kind = rest.get(name + 1..)?.iter().position(|&b| b == 0)?;
        let value = name + kind + 6; // two NUL, four bytes of size
        let size = i32::from_le_bytes(rest.get(value - 4..value)?.try_into().ok()?);
        let length = value + usize::try_from(size).ok()?;
        let (attribute, after) = rest.split_at_checked(length)?;
        attributes.push(attribute.to_vec());
        rest = after;
    }
    attributes.sort();
    let header = attributes.concat();
    file.get_mut(START..START + header.len())?.copy_from_slice(&header);
    Some(())
}

/// The image in the bytes of a file; see [`super::read`].
pub(super) fn decode(file: &[u8]) -> Result<Image, Failure> {
    let reader = exr::block::read(Cursor::new(file), false).map_err(codec)?;
    if let Some(compression) = reader.headers().iter().find_map(unsafe_compression) {
        let reason = "are read where the picture is their only part, of R, G, B or of Y; 'oiiotool IN --compression zip -o OUT' converts others";
        return Err(Failure::Unsupported(format!("EXR files of compression {compression} {reason}")));
    }
    let (part, targets) = reader
        .headers()
        .iter()
        .enumerate()
        .find_map(|(i, header)| Some((i, targets(header)?)))
        .ok_or_else(|| Failure::Unsupported("the file has neither channels R, G, B nor a channel Y".to_owned()))?;
    let header = &reader.headers()[part];
    if !is_flat(header) {
        return Err(Failure::Unsupported("deep or subsampled EXR files are not read".to_owned()));
    }
    // All parts: the decoder takes memory for each.
    for header in reader.headers() {
        plausible_pixels(header.layer_size.width(), header.layer_size.height(), file.len())?;
    }
    let (width, height) = (header.layer_size.width(), header.layer_size.height());
    let n = plausible_pixels(width, height, file.len())?;
    let mut pixels = room(n)?;
    pixels.resize(n, Rgb::ZERO);

    let chunks = reader.all_chunks(false).map_err(codec)?;
    let meta = chunks.meta_data().clone();
    let channels = &meta.headers[part].channels;
    // Samples seen per row: a damaged file may hold a block twice and miss another.
    let mut seen = room(height)?;
    seen.resize(height, 0);
    for chunk in chunks {
        let chunk = chunk.map_err(codec)?;
        if chunk.layer_index != part {
            continue;
        }
        let block = UncompressedBlock::decompress_chunk(chunk, &meta, false).map_err(codec)?;
        let BlockIndex { pixel_position: at, pixel_size: size, level, .. } = block.index;
        if level != Vec2(0, 0) {
            continue;
        }
        if at.x() + size.width() > width || at.y() + size.height() > height {
            return Err(Failure::Codec("damaged: a block lies outside of the image".to_owned()));
        }
        for line in block.lines(channels) {
            let (row, channel) = (line.location.position.y(), line.location.channel);
            let start = row * width + line.location.position.x();
            let row_pixels = &mut pixels[start..start + line.location.sample_count];
            seen[row] += row_pixels.len();
            let into = targets[channel];
            match channels.list[channel].sample_type {
                SampleType::F16 => put(row_pixels, into, line.read_samples::<f16>(), f16::to_f32),
                SampleType::F32 => put(row_pixels, into, line.read_samples::<f32>(), |x| x),
                SampleType::U32 => put(row_pixels, into, line.read_samples::<u32>(), |x| x as f32),
            }?;
        }
    }
    if seen.iter().any(|&samples| samples != width * channels.list.len()) {
        return Err(Failure::Codec("damaged: pixels are missing".to_owned()));
    }
    Ok(Image::new(width as u32, height as u32, pixels))
}

/// The compression of a file whose only part is the image, if that is left to OpenImageIO, which takes the first three
/// channels, or one if there are no three, and integers for sRGB.
pub(super) fn left_to_openimageio(file: &[u8]) -> Result<Option<Compression>, Failure> {
    let reader = exr::block::read(Cursor::new(file), false).map_err(codec)?;
    let [header] = reader.headers() else { return Ok(None) };
    let channels = &header.channels.list;
    let has = |name: &str| channels.iter().any(|channel| channel.name.eq(name));
    let same = ["R", "G", "B"].into_iter().all(has) || has("Y") && channels.len() == 1 + usize::from(has("A"));
    let real = channels.iter().all(|channel| channel.sample_type != SampleType::U32);
    plausible_pixels(header.layer_size.width(), header.layer_size.height(), file.len())?;
    Ok(unsafe_compression(header).filter(|_| same && real && is_flat(header)))
}

/// Damaged files make the decoder of B44 panic, and that of DWA take so much memory that the process
/// aborts (exr 1.74.2; found by 30 000 mutated files, through which the others came unharmed).
fn unsafe_compression(header: &Header) -> Option<Compression> {
    use Compression::{PIZ, PXR24, RLE, Uncompressed, ZIP1, ZIP16};
    let is_safe = matches!(header.compression, Uncompressed | RLE | ZIP1 | ZIP16 | PIZ | PXR24);
    (!is_safe).then_some(header.compression)
}

fn is_flat(header: &Header) -> bool {
    !header.deep && header.channels.list.iter().all(|channel| channel.sampling == Vec2(1, 1))
}

/// Refuses what is no latitude-longitude map of all directions: a part of one, or a cube.
pub(super) fn check_surrounds(file: &[u8]) -> Result<(), Failure> {
    let reader = exr::block::read(Cursor::new(file), false).map_err(codec)?;
    let Some(header) = reader.headers().iter().find(|header| targets(header).is_some()) else { return Ok(()) };
    let (display, own) = (header.shared_attributes.display_window, &header.own_attributes);
    if (own.layer_position, header.layer_size) != (display.position, display.size) {
        let reason = "its pixels fill a part of its display window; all of it was expected, from pole to pole";
        return Err(Failure::Unsupported(reason.to_owned()));
    }
    if own.environment_map == Some(EnvironmentMap::Cube) {
        return Err(Failure::Unsupported("it is a cube map; latitude by longitude was expected".to_owned()));
    }
    Ok(())
}

/// Which of r, g, b each channel of the file fills; none if these are not all filled.
fn targets(header: &Header) -> Option<Vec<[bool; 3]>> {
    let has = |name: &str| header.channels.list.iter().any(|channel| channel.name.eq(name));
    let colour = has("R") && has("G") && has("B");
    (colour || has("Y")).then(|| {
        let target = |name: &Text| match colour {
            true => ["R", "G", "B"].map(|wanted| name.eq(wanted)),
            false => [name.eq("Y"); 3],
        };
        header.channels.list.iter().map(|channel| target(&channel.name)).collect()
    })
}

fn put<T>(
    pixels: &mut [Rgb],
    into: [bool; 3],
    samples: impl Iterator<Item = exr::error::Result<T>>,
    convert: impl Fn(T) -> f32,
) -> Result<(), Failure> {
    if into == [false; 3] {
        return Ok(());
    }
    for (pixel, sample) in pixels.iter_mut().zip(samples) {
        let value = convert(sample.map_err(codec)?);
        for (i, _) in into.iter().enumerate().filter(|(_, wanted)| **wanted) {
            pixel[i] = value;
        }
    }
    Ok(())
}

fn codec(error: exr::error::Error) -> Failure {
    match error {
        exr::error::Error::NotSupported(what) => Failure::Unsupported(format!("not supported: {what}")),
        exr::error::Error::Io(source) => Failure::Codec(format!("damaged: {source}")),
        other => Failure::Codec(format!("damaged: {other}")),
    }
}
