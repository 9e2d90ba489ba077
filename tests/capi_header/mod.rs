//! Names in `caustica.h`: what the tests hold against the library. The header is written in one
//! style, which is all that this reads.

use std::collections::{BTreeMap, BTreeSet};

/// What the header declares.
pub(crate) struct Header {
    /// Function names.
    pub(crate) functions: BTreeSet<String>,
    /// Fields of each struct with a body, handles apart.
    pub(crate) structs: BTreeMap<String, Vec<String>>,
    /// Enumerators and object-like macros that have a value.
    pub(crate) constants: BTreeSet<String>,
}

impl Header {
    pub(crate) fn parse(source: &str) -> Header {
        let code = without_comments(source);
        let words = words(&code);
        let mut header = Header { functions: BTreeSet::new(), structs: BTreeMap::new(), constants: BTreeSet::new() };
        for (name, rest) in &words {
            if name.starts_with("caustica_") && rest.trim_start().starts_with('(') {
                header.functions.insert(name.to_string());
            }
            if name.starts_with("CAUSTICA_") && rest.trim_start().starts_with('=') {
                header.constants.insert(name.to_string());
            }
        }
        for line in code.lines() {
            let mut parts = line.split_whitespace();
            if let (Some("#define"), Some(name), Some(_)) = (parts.next(), parts.next(), parts.next()) {
                header.constants.insert(name.to_owned());
            }
        }
        for body in code.split("typedef struct caustica_").skip(1).filter(|body| body.contains('{')) {
            let Some((name, rest)) = body.split_once('{').filter(|(name, _)| !name.contains(';')) else {
                continue;
            };
            let fields = rest.split('}').next().unwrap_or_default().split(';').filter_map(|declaration| {
                let declarator = declaration.split('[').next().unwrap_or_default();
                words_of(declarator).last().map(|name| name.to_string())
            });
            header.structs.insert(format!("caustica_{}", name.trim()), fields.collect());
        }
        assert!(header.functions.len() > 30 && header.structs.len() > 8 && header.constants.len() > 40);
        header
    }
}

fn without_comments(source: &str) -> String {
    let mut code = String::new();
    let mut rest = source;
    while let Some((before, comment)) = rest.split_once("/*") {
        code += before;
        rest = comment.split_once("*/").expect("a comment that does not end").1;
    }
    code + rest
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

fn words_of(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c| !is_word(c)).filter(|word| !word.is_empty())
}

/// Each identifier, with what follows it.
fn words(code: &str) -> Vec<(&str, &str)> {
    let mut found = Vec::new();
    let mut rest = code;
    while let Some(start) = rest.find(is_word) {
        let end = rest[start..].find(|c| !is_word(c)).map_or(rest.len(), |n| start + n);
        found.push((&rest[start..end], &rest[end..]));
        rest = &rest[end..];
    }
    found
}
