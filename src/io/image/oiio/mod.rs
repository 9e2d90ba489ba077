//! OpenImageIO, through a module of its own.
//!
//! Debian's libOpenImageIO brings 261 shared objects, 120 MB and four threads into the process. A
//! host that renders to memory or to EXR must not pay for that, so this library does not link it:
//! `shim.cpp` is linked with it into `libcaustica_oiio.so`, which `module` opens at the first need.
//! Bytes go in, bytes come out; the module touches no file.
#![allow(unsafe_code)]

mod module;

use super::metadata::{REC709, SOFTWARE, Value, Window};
use super::picture::{Picture, Samples};
use super::{Failure, Format, Metadata, Stored, StoredSamples, plausible_pixels, room};
use module::{CAttribute, CHeader, CPicture, Kind, Sample};
use std::ffi::{CStr, CString, c_char, c_void};

/// Bytes. A JPEG segment holds 64 KiB; its writer ends the process (OpenImageIO 2.4) when one is longer.
const DESCRIPTION_LIMIT: usize = 8192;
/// Pixels. The same end awaits a larger picture.
const JPEG_LIMIT: u32 = 65_500;

/// OpenImageIO's version, for example `2.4.7.1`.
pub(super) fn version() -> Result<&'static str, Failure> {
    Ok(module::get()?.version)
}

/// The bytes of a file.
pub(super) fn encode(format: Format, picture: &Picture, metadata: &Metadata) -> Result<Vec<u8>, Failure> {
    if format == Format::Jpeg && picture.width.max(picture.height) > JPEG_LIMIT {
        let (width, height) = (picture.width, picture.height);
        return Err(Failure::Unsupported(format!(
            "{width}x{height} is too large for JPEG, which ends at {JPEG_LIMIT}"
        )));
    }
    let module = module::get()?;
    let (sample, samples, size) = match &picture.samples {
        Samples::Bytes(s) => (Sample::Byte, s.as_ptr().cast::<c_void>(), size_of_val(s.as_slice())),
        Samples::Half(s) => (Sample::Half, s.as_ptr().cast(), size_of_val(s.as_slice())),
        Samples::Float(s) => (Sample::Float, s.as_ptr().cast(), size_of_val(s.as_slice())),
    };
    let all = Metadata::new().window(picture.width, picture.height);
    let windows = matches!(format, Format::Exr | Format::Tiff);
    let Window { data, frame } = if windows { metadata.window(picture.width, picture.height) } else { all };
    let c_picture = CPicture {
        width: picture.width as i32,
        height: picture.height as i32,
        x: data.x as i32,
        y: data.y as i32,
        frame_width: frame[0] as i32,
        frame_height: frame[1] as i32,
        sample,
        samples,
        size,
    };
    let attributes = Attribute::all(format, metadata)?;
    let c_attributes: Vec<CAttribute> = attributes.iter().map(Attribute::as_c).collect();
    let name = c_string(format.name())?;
    let mut file: Vec<u8> = Vec::new();
    call(|message, capacity| {
        // SAFETY: `name`, `c_picture` with its samples, `attributes` behind `c_attributes`, and `file`
        // behind the context outlive the call; the lengths are theirs; `sink` takes that context.
        unsafe {
            (module.encode)(
                name.as_ptr(),
                &c_picture,
                c_attributes.as_ptr(),
                c_attributes.len(),
                sink,
                (&raw mut file).cast(),
                message,
                capacity,
            )
        }
    })?;
    Ok(file)
}

/// The image in the bytes of a file, as it is stored there; of at most so many pixels.
pub(super) fn decode(format: Format, file: &[u8], most: usize) -> Result<Stored, Failure> {
    let module = module::get()?;
    let name = c_string(format.name())?;
    let mut decoded = Decoded {
        file: file.len(),
        most,
        header: CHeader::default(),
        samples: StoredSamples::Floats(Vec::new()),
        refusal: None,
    };
    let called = call(|message, capacity| {
        // SAFETY: `name`, `file` and `decoded` outlive the call; the length is the file's; `buffer`
        // takes `decoded` as its context.
        unsafe {
            (module.decode)(
                name.as_ptr(),
                file.as_ptr(),
                file.len(),
                buffer,
                (&raw mut decoded).cast(),
                message,
                capacity,
            )
        }
    });
    if let Some(refusal) = decoded.refusal {
        return Err(refusal);
    }
    called?;
    let CHeader { width, height, channels, .. } = decoded.header;
    let [width, height, channels] = [width, height, channels].map(i32::unsigned_abs);
    Ok(Stored { width, height, channels, samples: decoded.samples })
}

/// What the module fills while it decodes.
struct Decoded {
    /// Bytes of the file.
    file: usize,
    /// Most pixels.
    most: usize,
    header: CHeader,
    samples: StoredSamples,
    refusal: Option<Failure>,
}

/// Makes room for the samples; null, and a refusal, if that cannot be.
extern "C" fn buffer(context: *mut c_void, header: *const CHeader) -> *mut c_void {
    // SAFETY: `decode` passes a `Decoded` that nobody else holds during the call, and the module a
    // header that lives until this returns.
    let (decoded, header) = unsafe { (&mut *context.cast::<Decoded>(), *header) };
    let size = |n: i32| usize::try_from(n).unwrap_or(0);
    let made = plausible_pixels(size(header.width), size(header.height), decoded.file).and_then(|pixels| {
        if pixels > decoded.most {
            let reason = format!("it has {pixels} pixels; at most {} are read here", decoded.most);
            return Err(Failure::Unsupported(reason));
        }
        let n = pixels.checked_mul(size(header.channels)).ok_or(Failure::OutOfMemory)?;
        Ok(match header.bits {
            8 => StoredSamples::Bytes(filled(n)?),
            0 => StoredSamples::Floats(filled(n)?),
            _ => StoredSamples::Integers(filled(n)?),
        })
    });
    match made {
        Ok(samples) => {
            decoded.header = header;
            decoded.samples = samples;
            match &mut decoded.samples {
                StoredSamples::Bytes(samples) => samples.as_mut_ptr().cast(),
                StoredSamples::Integers(samples) | StoredSamples::Floats(samples) => samples.as_mut_ptr().cast(),
            }
        }
        Err(refusal) => {
            decoded.refusal = Some(refusal);
            std::ptr::null_mut()
        }
    }
}

fn filled<T: Clone + Default>(n: usize) -> Result<Vec<T>, Failure> {
    let mut values = room(n)?;
    values.resize(n, T::default());
    Ok(values)
}

/// Takes the whole encoded file; not 0 if there is no memory for it.
extern "C" fn sink(context: *mut c_void, data: *const u8, size: usize) -> i32 {
    if data.is_null() || size == 0 {
        return 0;
    }
    // SAFETY: `encode` passes a `Vec<u8>` that nobody else holds during the call, and the module
    // `size` initialised bytes that live until this returns.
    let (file, bytes) = unsafe { (&mut *context.cast::<Vec<u8>>(), std::slice::from_raw_parts(data, size)) };
    if file.try_reserve_exact(size).is_err() {
        return 1;
    }
    file.extend_from_slice(bytes);
    0
}

/// Calls with room for a message, which becomes the failure.
fn call(function: impl FnOnce(*mut c_char, usize) -> i32) -> Result<(), Failure> {
    let mut message = [0u8; 1024];
    if function(message.as_mut_ptr().cast(), message.len()) == 0 {
        return Ok(());
    }
    let text = CStr::from_bytes_until_nul(&message).unwrap_or_default();
    Err(Failure::Codec(format!("OpenImageIO: {}", text.to_string_lossy().trim())))
}

fn c_string(text: &str) -> Result<CString, Failure> {
    CString::new(text).map_err(|_| Failure::Unsupported(format!("{text:?} contains a NUL character")))
}

/// An attribute with its storage.
enum Attribute {
    Text(CString, CString),
    Int(CString, i32),
    Floats(CString, Vec<f32>),
}

impl Attribute {
    /// What OpenImageIO is told beside the pixels.
    fn all(format: Format, metadata: &Metadata) -> Result<Vec<Attribute>, Failure> {
        let text = |name: &str, value: &str| Ok(Attribute::Text(c_string(name)?, c_string(value)?));
        // EXR spells it so; the other formats know it under OpenImageIO's own name.
        let software = if format == Format::Exr { "software" } else { "Software" };
        let mut all = vec![text(software, SOFTWARE)?];
        let description = metadata.description(DESCRIPTION_LIMIT);
        // An empty one trips an assertion of OpenImageIO's IPTC writer, which ends the process.
        if format != Format::Exr && !description.is_empty() {
            all.push(text("ImageDescription", &description)?);
        }
        match format {
            Format::Exr => {
                let xy = REC709.iter().flat_map(|&(x, y)| [x, y]).collect();
                all.push(Attribute::Floats(c_string("chromaticities")?, xy));
                all.push(text("compression", "zip")?);
                for (name, value) in metadata.attributes() {
                    let name = c_string(&name)?;
                    all.push(match value {
                        Value::Text(value) => Attribute::Text(name, c_string(&value)?),
                        Value::Int(value) => Attribute::Int(name, value),
                        Value::Float(value) => Attribute::Floats(name, vec![value]),
                    });
                }
            }
            Format::Png => all.push(text("oiio:ColorSpace", "sRGB")?),
            Format::Jpeg => {
                all.push(text("oiio:ColorSpace", "sRGB")?);
                all.push(text("compression", "jpeg:95")?);
                all.push(text("jpeg:subsampling", "4:4:4")?);
            }
            Format::Tiff => {
                all.push(text("oiio:ColorSpace", "Linear")?);
                all.push(text("compression", "zip")?);
            }
            Format::Hdr => {}
        }
        Ok(all)
    }

    /// Borrows: valid as long as `self` stays where it is.
    fn as_c(&self) -> CAttribute {
        let (name, data, kind, count) = match self {
            Attribute::Text(name, value) => (name, value.as_ptr().cast::<c_void>(), Kind::Text, 1),
            Attribute::Int(name, value) => (name, (&raw const *value).cast(), Kind::Int, 1),
            Attribute::Floats(name, values) => (name, values.as_ptr().cast(), Kind::Floats, values.len() as i32),
        };
        CAttribute { name: name.as_ptr(), data, kind, count }
    }
}
