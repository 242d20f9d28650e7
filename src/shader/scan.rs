// SPDX-License-Identifier: MIT OR Apache-2.0
//! A lexical scan of WGSL: enough to find declarations and their places without composing.

/// A token with its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Token<'a> {
    pub text: &'a str,
    /// 1-based.
    pub line: u32,
    /// 1-based, in characters.
    pub column: u32,
}

/// Splits WGSL into identifiers, numbers and single punctuation characters, and skips comments
/// (also nested block comments).
pub fn tokens(source: &str) -> Vec<Token<'_>> {
    let mut out = Vec::new();
    let mut chars = source.char_indices().peekable();
    let (mut line, mut column) = (1, 1);
    while let Some((start, c)) = chars.next() {
        let here = (line, column);
        let next = chars.peek().map(|&(_, c)| c);
        advance(c, &mut line, &mut column);
        if c == '/' && next == Some('/') {
            while let Some(&(_, c)) = chars.peek() {
                if c == '\n' {
                    break;
                }
                chars.next();
                advance(c, &mut line, &mut column);
            }
        } else if c == '/' && next == Some('*') {
            let mut depth = 0;
            let mut previous = c;
            for (_, c) in chars.by_ref() {
                advance(c, &mut line, &mut column);
                match (previous, c) {
                    ('/', '*') => {
                        depth += 1;
                        previous = ' ';
                    }
                    ('*', '/') => {
                        depth -= 1;
                        previous = ' ';
                        if depth == 0 {
                            break;
                        }
                    }
                    _ => previous = c,
                }
            }
        } else if is_word(c) {
            let mut end = start + c.len_utf8();
            while let Some(&(at, c)) = chars.peek() {
                if !is_word(c) {
                    break;
                }
                end = at + c.len_utf8();
                chars.next();
                advance(c, &mut line, &mut column);
            }
            out.push(Token { text: &source[start..end], line: here.0, column: here.1 });
        } else if !c.is_whitespace() {
            out.push(Token {
                text: &source[start..start + c.len_utf8()],
                line: here.0,
                column: here.1,
            });
        }
    }
    out
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn advance(c: char, line: &mut u32, column: &mut u32) {
    if c == '\n' {
        *line += 1;
        *column = 1;
    } else {
        *column += 1;
    }
}

/// A declaration at module scope that matters to the rules of the layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Declaration<'a> {
    pub kind: DeclarationKind<'a>,
    pub line: u32,
    pub column: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeclarationKind<'a> {
    /// `@group(…) @binding(…) var… name`: the two numbers and the name as written.
    Binding { group: &'a str, binding: &'a str, name: &'a str },
    /// `var<workgroup>`, `var<private>`: the address space.
    Variable(&'a str),
    /// `@compute`, `@vertex`, `@fragment`.
    Entry(&'a str),
    /// `@workgroup_size`.
    WorkgroupSize,
}

/// Every binding, module-scope variable and entry point.
pub fn declarations(source: &str) -> Vec<Declaration<'_>> {
    let tokens = tokens(source);
    let text = |ix: usize| tokens.get(ix).map_or("", |token| token.text);
    let mut out = Vec::new();
    for (ix, token) in tokens.iter().enumerate() {
        let kind = match token.text {
            "@" => match text(ix + 1) {
                "group" => {
                    let end =
                        (ix..tokens.len()).find(|&at| text(at) == ";").unwrap_or(tokens.len());
                    let number = |of| {
                        let at = (ix..end).find(|&at| text(at) == of).map_or(end, |at| at + 2);
                        text(at)
                    };
                    // The name is the token before the colon of its type.
                    let colon = (ix..end).find(|&at| text(at) == ":").unwrap_or(end);
                    let name = text(colon.saturating_sub(1));
                    DeclarationKind::Binding {
                        group: number("group"),
                        binding: number("binding"),
                        name,
                    }
                }
                "workgroup_size" => DeclarationKind::WorkgroupSize,
                stage @ ("compute" | "vertex" | "fragment") => DeclarationKind::Entry(stage),
                _ => continue,
            },
            "var" if text(ix + 1) == "<" => match text(ix + 2) {
                space @ ("workgroup" | "private") => DeclarationKind::Variable(space),
                _ => continue,
            },
            _ => continue,
        };
        out.push(Declaration { kind, line: token.line, column: token.column });
    }
    out
}

/// A path that an `#import` names: a module, or an item of one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Import {
    pub path: String,
    pub line: u32,
    pub column: u32,
}

impl Import {
    /// Whether this names the module or an item of it.
    pub fn is_of(&self, module: &str) -> bool {
        self.path == module || self.parent() == Some(module)
    }

    /// The path without its last segment.
    pub fn parent(&self) -> Option<&str> {
        self.path.rsplit_once("::").map(|(parent, _)| parent)
    }
}

/// Every path of every `#import`, used in the text or not; nested braces are expanded.
pub fn imports(source: &str) -> Vec<Import> {
    let tokens = tokens(source);
    let mut out = Vec::new();
    for (ix, pair) in tokens.windows(2).enumerate() {
        if pair[0].text == "#" && pair[1].text == "import" {
            let mut at = ix + 2;
            import_tree(&tokens, &mut at, "", &mut out);
        }
    }
    out
}

/// Reads one path, or the braces at its end, starting at token `at`.
fn import_tree(tokens: &[Token<'_>], at: &mut usize, prefix: &str, out: &mut Vec<Import>) {
    let text = |ix: usize| tokens.get(ix).map_or("", |token| token.text);
    let Some(&Token { line, column, .. }) = tokens.get(*at) else { return };
    let mut path = prefix.to_owned();
    while text(*at).starts_with(is_word) {
        if !path.is_empty() {
            path.push_str("::");
        }
        path.push_str(text(*at));
        *at += 1;
        if text(*at) != ":" || text(*at + 1) != ":" {
            if text(*at) == "as" {
                *at += 2;
            }
            return out.push(Import { path, line, column });
        }
        *at += 2;
    }
    if text(*at) == "{" {
        *at += 1;
        while !matches!(text(*at), "}" | "") {
            let before = *at;
            import_tree(tokens, at, &path, out);
            // naga_oil reports what is neither a path nor a comma.
            *at += usize::from(text(*at) == "," || *at == before);
        }
        *at += 1;
    }
}

/// What `#define_import_path` declares, and where.
pub fn defined_import_path(source: &str) -> Option<Import> {
    let tokens = tokens(source);
    let ix = tokens
        .windows(2)
        .position(|pair| pair[0].text == "#" && pair[1].text == "define_import_path")?;
    let mut found = Vec::new();
    import_tree(&tokens, &mut (ix + 2), "", &mut found);
    let path = found.pop().map_or_else(String::new, |import| import.path);
    Some(Import { path, line: tokens[ix].line, column: tokens[ix].column })
}

/// Where `needle` first occurs in `source`: 1-based line and column; (1, 1) if it does not occur.
pub fn place_of(source: &str, needle: &str) -> (u32, u32) {
    source.find(needle).map_or((1, 1), |at| end_of(&source[..at]))
}

/// Line and column of what would follow `text`.
pub fn end_of(text: &str) -> (u32, u32) {
    let line = text.matches('\n').count() as u32 + 1;
    let column = text.rsplit('\n').next().map_or(0, |l| l.chars().count()) as u32 + 1;
    (line, column)
}

/// Names of the functions, structs, constants and variables at module scope.
pub fn declared_names(source: &str) -> Vec<&str> {
    let tokens = tokens(source);
    let text = |ix: usize| tokens.get(ix).map_or("", |token| token.text);
    let mut depth = 0;
    let mut out = Vec::new();
    for (ix, token) in tokens.iter().enumerate() {
        match token.text {
            "{" => depth += 1,
            "}" => depth -= 1,
            "fn" | "struct" | "const" | "override" | "alias" if depth == 0 => {
                out.push(text(ix + 1))
            }
            "var" if depth == 0 => {
                let closed = (ix..tokens.len()).find(|&at| text(at) == ">");
                let name =
                    if text(ix + 1) == "<" { closed.map_or(ix, |at| at + 1) } else { ix + 1 };
                out.push(text(name));
            }
            _ => {}
        }
    }
    out
}
