//! How caustic connections are made, as a host says it. Zero means the default in every field.

use super::error::Failure;
use super::pointer::Sized32;
use crate::transport::options::{self, Check, GeometryTerm};
use crate::transport::roulette::Roulette;

/// The generalised geometry term.
pub const GEOMETRY_TERM_EXACT: u32 = 0;
/// As if nothing were between the ends.
pub const GEOMETRY_TERM_DIRECT: u32 = 1;

/// By the connection's own walk.
pub const CHECK_EXACT: u32 = 0;
/// By its first steps.
pub const CHECK_FEW: u32 = 1;
/// Not at all.
pub const CHECK_OFF: u32 = 2;

/// By what a connection is expected to contribute.
pub const ROULETTE_CONTRIBUTION: u32 = 0;
/// By the lengths of the subpaths.
pub const ROULETTE_LENGTHS: u32 = 1;
/// All are tried.
pub const ROULETTE_OFF: u32 = 2;

/// `caustica_caustic_options`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct CausticOptions {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// A `GEOMETRY_TERM_`.
    pub geometry_term: u32,
    /// A `CHECK_`.
    pub check: u32,
    /// A `ROULETTE_`.
    pub roulette: u32,
    /// Multiple of the mean radiance.
    pub roulette_threshold: f32,
    /// Walks from one pair of ends at most.
    pub seeds: u32,
    /// Probability; negative for none.
    pub search: f32,
    /// Share; negative for none.
    pub aim: f32,
    /// Per sample.
    pub light_subpaths: f32,
    /// Most steps of a walk.
    pub walk_iterations: u32,
    /// Radians.
    pub walk_tolerance: f64,
}

// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CausticOptions {
    const NAME: &'static str = "caustica_caustic_options";
    const FIRST_SIZE: usize = 48;
}

impl CausticOptions {
    /// Their meaning. The numbers' limits are the renderer's to check.
    pub(super) fn convert(&self) -> Result<options::CausticOptions, Failure> {
        let default = options::CausticOptions::default();
        let unknown = |field, value: u32, prefix: &str| {
            Err(Failure::argument(field, format!("is {value}; a CAUSTICA_{prefix} was expected")))
        };
        let geometry_term = match self.geometry_term {
            GEOMETRY_TERM_EXACT => GeometryTerm::Exact,
            GEOMETRY_TERM_DIRECT => GeometryTerm::Direct,
            other => return unknown("geometry_term", other, "GEOMETRY_TERM_"),
        };
        let check = match self.check {
            CHECK_EXACT => Check::Exact,
            CHECK_FEW => Check::Few,
            CHECK_OFF => Check::Off,
            other => return unknown("check", other, "CHECK_"),
        };
        let roulette = match self.roulette {
            ROULETTE_CONTRIBUTION if self.roulette_threshold == 0.0 => default.roulette,
            ROULETTE_CONTRIBUTION => Roulette::Contribution(self.roulette_threshold),
            ROULETTE_LENGTHS => Roulette::Lengths,
            ROULETTE_OFF => Roulette::Off,
            other => return unknown("roulette", other, "ROULETTE_"),
        };
        let mut walk = default.walk;
        if self.walk_tolerance != 0.0 {
            walk.tolerance = self.walk_tolerance;
        }
        Ok(options::CausticOptions {
            geometry_term,
            check,
            roulette,
            walk,
            max_iterations: (self.walk_iterations != 0).then_some(self.walk_iterations),
            seeds: (self.seeds != 0).then_some(self.seeds),
            search: or_none(self.search),
            aim: or_none(self.aim),
            light_subpaths: (self.light_subpaths != 0.0).then_some(self.light_subpaths),
        })
    }
}

/// Zero means the default, which is decided later, and less means none.
fn or_none(value: f32) -> Option<f32> {
    match value {
        0.0 => None,
        value if value < 0.0 => Some(0.0),
        value => Some(value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEFAULTS: CausticOptions = CausticOptions {
        struct_size: size_of::<CausticOptions>() as u32,
        geometry_term: 0,
        check: 0,
        roulette: 0,
        roulette_threshold: 0.0,
        seeds: 0,
        search: 0.0,
        aim: 0.0,
        light_subpaths: 0.0,
        walk_iterations: 0,
        walk_tolerance: 0.0,
    };

    #[test]
    fn zero_is_the_default() {
        assert_eq!(DEFAULTS.convert().unwrap(), options::CausticOptions::default());
    }

    #[test]
    fn the_papers_settings_are_those_of_the_header() {
        let paper = CausticOptions {
            geometry_term: GEOMETRY_TERM_DIRECT,
            check: CHECK_FEW,
            roulette: ROULETTE_LENGTHS,
            seeds: 1,
            search: -1.0,
            aim: -1.0,
            light_subpaths: 1.0,
            ..DEFAULTS
        };
        assert_eq!(paper.convert().unwrap(), options::CausticOptions::paper());
    }

    #[test]
    fn each_field_says_something() {
        let given = CausticOptions {
            check: CHECK_OFF,
            roulette_threshold: 2.0,
            seeds: 2,
            search: 0.125,
            aim: 0.75,
            light_subpaths: 0.5,
            walk_iterations: 7,
            walk_tolerance: 1e-6,
            ..DEFAULTS
        };
        let given = given.convert().unwrap();
        assert_eq!((given.check, given.roulette), (Check::Off, Roulette::Contribution(2.0)));
        assert_eq!((given.seeds, given.max_iterations), (Some(2), Some(7)));
        assert_eq!((given.search, given.aim, given.light_subpaths), (Some(0.125), Some(0.75), Some(0.5)));
        assert_eq!(given.walk.tolerance, 1e-6);
        assert_eq!(CausticOptions { roulette: ROULETTE_OFF, ..DEFAULTS }.convert().unwrap().roulette, Roulette::Off);
    }
}
