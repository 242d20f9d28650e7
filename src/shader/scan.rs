//! A lexical look at WGSL: enough to find declarations and their places without composing.

/// A token with its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Token<'a> {
    pub text: &'a str,
    /// 1-based.
    pub line: u32,
    /// 1-based, in characters.
    pub column: u32,
}

/// Splits WGSL into identifiers, numbers and single punctuation characters; comments (nested block
/// comments too) are passed over.
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

/// A `var` at module scope, as far as the layers care.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Declaration<'a> {
    pub kind: DeclarationKind<'a>,
    pub line: u32,
    pub column: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeclarationKind<'a> {
    /// `@group(N)`.
    Group(&'a str),
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
                "group" => DeclarationKind::Group(text(ix + 3)),
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

/// Where `needle` first stands in `source`: 1-based line and column; (1, 1) if it does not.
pub fn place_of(source: &str, needle: &str) -> (u32, u32) {
    source.find(needle).map_or((1, 1), |at| {
        let before = &source[..at];
        let line = before.matches('\n').count() as u32 + 1;
        let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) as u32 + 1;
        (line, column)
    })
}
