//! Words of hosts and files in messages.

use std::path::Path;

/// Most characters that a message repeats.
const LONGEST: usize = 200;

/// `name` as a message shows it: control characters, line ends among them, are escaped, and what is too long is cut. It
/// may come from a file, and the message may go to a terminal.
pub(crate) fn shown(name: &str) -> String {
    let mut text: String = name.chars().take(LONGEST).map(escaped).collect();
    if name.chars().nth(LONGEST).is_some() {
        text.push('…');
    }
    text
}

/// `path` with its control characters escaped. Whole: its end is what tells it from others.
pub(crate) fn shown_path(path: &Path) -> String {
    path.to_string_lossy().chars().map(escaped).collect()
}

fn escaped(c: char) -> String {
    match c {
        '\'' | '"' | '\\' => c.to_string(),
        _ => c.escape_debug().to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_shown_on_one_line() {
        assert_eq!(shown("Glas 'ä' \\ 1"), "Glas 'ä' \\ 1");
        assert_eq!(shown("a\n\u{1b}]0;x\u{7}\u{202e}"), "a\\n\\u{1b}]0;x\\u{7}\\u{202e}");
        assert_eq!(shown(&"ä".repeat(200)), "ä".repeat(200));
        assert_eq!(shown(&"ä".repeat(201)), "ä".repeat(200) + "…");
        assert_eq!(shown_path(Path::new(&"a\u{1b}".repeat(200))), "a\\u{1b}".repeat(200));
    }
}
