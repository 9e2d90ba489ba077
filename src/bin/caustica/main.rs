//! The command line: the same calls a host makes, in the same order.
//!
//! Exit codes: 0 done, 1 failed, 2 wrong usage, 130 interrupted. Results that are asked for go to standard output,
//! all else to standard error.

mod args;
mod backends;
mod compare;
mod console;
mod info;
mod pixel;
mod progress;
mod render;
mod scene;
mod units;
mod view;
mod walks;

use args::{Cli, Command};
use caustica::render::RenderError;
use clap::Parser;
use std::process::ExitCode;

/// Why a command could not do its work, in words that name the object and the value.
type Failure = Box<dyn std::error::Error>;

/// Exit code after an interrupt, as shells have it: 128 and the signal's number.
const INTERRUPTED: u8 = 130;

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Render(args) => render::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Pixel(args) => pixel::run(&args),
        Command::Backends(args) => backends::run(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            console::error(failure.as_ref());
            match failure.downcast_ref() {
                Some(RenderError::Setting { .. }) => ExitCode::from(2),
                _ if failure.is::<render::Interrupted>() => ExitCode::from(INTERRUPTED),
                _ => ExitCode::FAILURE,
            }
        }
    }
}
