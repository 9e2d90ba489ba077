//! Where text goes: notes, warnings and errors to standard error, results to standard output.

use std::error::Error;
use std::io::{ErrorKind, Write};

/// Notes and warnings, unless the user asked for quiet.
#[derive(Clone, Copy)]
pub(crate) struct Console {
    pub(crate) quiet: bool,
}

impl Console {
    pub(crate) fn note(self, text: &str) {
        if !self.quiet {
            stderr(text);
        }
    }

    pub(crate) fn warn(self, text: &str) {
        if !self.quiet {
            stderr(&format!("warning: {text}"));
        }
    }
}

/// Reports why a command failed.
pub(crate) fn error(error: &dyn Error) {
    stderr(&format!("error: {}", chain(error)));
}

/// An error with its causes, those left out that its own words already hold.
pub(crate) fn chain(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        let words = inner.to_string();
        if !text.contains(&words) {
            text = format!("{text}: {words}");
        }
        cause = inner.source();
    }
    text
}

/// Prints results. A reader that has seen enough (`caustica info scene.glb | head -n 1`) is no error, and the end.
pub(crate) fn print(text: &str) -> Result<(), crate::Failure> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Ok(()) => Ok(()),
        Err(e) if e.kind() == ErrorKind::BrokenPipe => std::process::exit(0),
        Err(e) => Err(format!("standard output: {e}").into()),
    }
}

/// A closed standard error leaves nowhere to complain.
fn stderr(text: &str) {
    let _ = writeln!(std::io::stderr(), "caustica: {text}");
}
