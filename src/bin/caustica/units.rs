//! Numbers as people read them.

/// Three significant digits with a decimal prefix: `12.3 M`.
pub(crate) fn si(x: f64) -> String {
    const PREFIXES: [&str; 6] = ["", " k", " M", " G", " T", " P"];
    let mut scaled = x;
    for prefix in PREFIXES {
        // The rounded value decides: 999.7 is "1.00 k".
        let digits = match scaled.abs() {
            s if s < 9.995 => 2,
            s if s < 99.95 => 1,
            _ => 0,
        };
        if scaled.abs() < 999.5 {
            return match prefix {
                "" if x.fract() == 0.0 => format!("{x:.0}"),
                _ => format!("{scaled:.digits$}{prefix}"),
            };
        }
        scaled /= 1000.0;
    }
    format!("{x:.2e}")
}

/// Seconds: `0.53 s`, `12.3 s`, `4:05`, `2:00:00`.
pub(crate) fn time(seconds: f64) -> String {
    match seconds {
        s if s < 9.995 => format!("{s:.2} s"),
        s if s < 59.95 => format!("{s:.1} s"),
        s => {
            let whole = s.round() as u64;
            let (h, m, s) = (whole / 3600, whole / 60 % 60, whole % 60);
            if h > 0 { format!("{h}:{m:02}:{s:02}") } else { format!("{m}:{s:02}") }
        }
    }
}

/// Bytes with a binary prefix: `1.5 MiB`.
pub(crate) fn bytes(n: u64) -> String {
    const PREFIXES: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
    let mut scaled = n as f64;
    let mut prefix = 0;
    while scaled >= 1023.95 && prefix + 1 < PREFIXES.len() {
        scaled /= 1024.0;
        prefix += 1;
    }
    if prefix == 0 { format!("{n} B") } else { format!("{scaled:.1} {}", PREFIXES[prefix]) }
}

/// A count with its noun: `1 light`, `2 lights`.
pub(crate) fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefixes_change_where_the_rounded_number_does() {
        let cases = [(0.0, "0"), (12.0, "12"), (0.5, "0.50"), (999.0, "999"), (999.7, "1.00 k"), (1234.0, "1.23 k")];
        for (x, text) in cases {
            assert_eq!(si(x), text);
        }
        assert_eq!(si(99_960.0), "100 k");
        assert_eq!(si(12.34e6), "12.3 M");
    }

    #[test]
    fn times_carry() {
        for (s, text) in [(0.0, "0.00 s"), (9.999, "10.0 s"), (59.96, "1:00"), (245.0, "4:05"), (7199.6, "2:00:00")] {
            assert_eq!(time(s), text);
        }
    }

    #[test]
    fn byte_counts() {
        for (n, text) in [(0, "0 B"), (1023, "1023 B"), (1536, "1.5 KiB"), (1024 * 1024 - 1, "1.0 MiB")] {
            assert_eq!(bytes(n), text);
        }
    }
}
