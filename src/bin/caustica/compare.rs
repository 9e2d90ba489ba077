//! `caustica compare`.

use crate::args::Compare;
use crate::console::{self, Console};
use crate::{Failure, units};
use caustica::io::image::{self, Metadata, WriteOptions};
use caustica::render::compare::{Comparison, compare, difference_picture};

pub(crate) fn run(args: &Compare) -> Result<(), Failure> {
    if let Some(path) = &args.diff {
        image::check_writable(path, &WriteOptions::default())?;
    }
    let a = image::read(&args.image)?;
    let b = image::read(&args.reference)?;
    let both = |error| format!("{} and {}: {error}", args.image.display(), args.reference.display());
    let comparison = compare(&a, &b).map_err(both)?;
    console::print(&table(&comparison))?;
    if let Some(path) = &args.diff {
        image::write(path, &difference_picture(&a, &b).map_err(both)?, &Metadata::new(), &WriteOptions::default())?;
        Console { quiet: false }.note(&format!("wrote {}", path.display()));
    }
    Ok(())
}

/// One quantity a line, its numbers last: for people and for `awk`.
pub(crate) fn table(c: &Comparison) -> String {
    let rgb = |v: [f64; 3], unit: &str| v.map(|x| format!("{x:>12.6}{unit}")).join(" ");
    let left_out = format!("without the worst {}", units::count(c.trimmed, "pixel", "pixels"));
    [
        format!("mean            {}", rgb(c.mean, "")),
        format!("reference mean  {}", rgb(c.reference_mean, "")),
        format!("bias            {}", rgb(c.bias.map(|x| 100.0 * x), " %")),
        format!("luminance bias  {:>12.6} %", 100.0 * c.luminance_bias),
        format!("MSE             {:>12.6e}", c.mse),
        format!("relMSE          {:>12.6e}", c.rel_mse),
        format!("relMSE trimmed  {:>12.6e}   {left_out}", c.rel_mse_trimmed),
    ]
    .map(|line| line.trim_end().to_owned() + "\n")
    .concat()
}
