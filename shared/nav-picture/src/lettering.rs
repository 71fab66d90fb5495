//! Text as strokes, so that a picture looks the same where no font is installed.
//!
//! A glyph is SVG path data on a grid: the baseline at y = 0, capitals 7 units high, small letters 5.

use std::fmt::Write;

/// Height of a capital, units.
const CAPITAL: f32 = 7.0;
/// Between two glyphs, units.
const SPACING: f32 = 1.9;
const SPACE: f32 = 2.4;

/// Where a line of text stands relative to its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// The text begins at the point.
    Start,
    /// The point is its middle.
    Middle,
    /// The text ends at the point.
    End,
}

/// Appends a line of text: baseline at (x, y), capitals `height` pixels high. Text that is wider than
/// `width_max` pixels is made smaller.
pub fn write_text(svg: &mut String, text: &str, at: (f32, f32), anchor: Anchor, style: &Style) {
    let units = width_of(text);
    let scale = (style.height / CAPITAL).min(style.width_max / units.max(1.0));
    let x = match anchor {
        Anchor::Start => at.0,
        Anchor::Middle => at.0 - units * scale / 2.0,
        Anchor::End => at.0 - units * scale,
    };
    let mut data = String::new();
    let mut pen = 0.0;
    for letter in text.chars() {
        let (width, path) = glyph(letter);
        push_shifted(&mut data, path, pen);
        pen += width + SPACING;
    }
    writeln!(
        svg,
        r#"<path transform="translate({x:.1} {:.1}) scale({scale:.3})" d="{data}" fill="none" stroke="{}" stroke-width="{:.2}" stroke-linecap="round" stroke-linejoin="round"/>"#,
        at.1, style.color, style.weight
    )
    .expect("a string takes everything");
}

/// How text looks.
pub struct Style {
    /// Height of a capital, px.
    pub height: f32,
    /// Longest line, px.
    pub width_max: f32,
    /// Any colour of SVG.
    pub color: &'static str,
    /// Width of a stroke, units of the glyph grid.
    pub weight: f32,
}

fn width_of(text: &str) -> f32 {
    text.chars().map(|letter| glyph(letter).0 + SPACING).sum::<f32>() - SPACING
}

/// Appends path data moved right by `shift`. The data is absolute, commands and numbers parted by spaces.
fn push_shifted(data: &mut String, path: &str, shift: f32) {
    // What the next number is: 'x', 'y', or one of the five numbers of an arc before its end point.
    let mut command = 'M';
    let mut index = 0;
    for token in path.split(' ').filter(|token| !token.is_empty()) {
        let Ok(number) = token.parse::<f32>() else {
            command = token.chars().next().unwrap_or('M');
            index = 0;
            data.push_str(token);
            continue;
        };
        let is_x = match command {
            'V' => false,
            'H' => true,
            'A' => index % 7 == 5,
            _ => index % 2 == 0,
        };
        let number = if is_x { number + shift } else { number };
        write!(data, "{} ", (number * 100.0).round() / 100.0).expect("a string takes everything");
        index += 1;
    }
}

/// Width and path of a glyph; a box for what is not drawn here.
fn glyph(letter: char) -> (f32, &'static str) {
    match letter {
        ' ' => (SPACE, ""),
        '0'..='9' => digit(letter),
        'a'..='z' => small(letter),
        'A'..='Z' => capital(letter),
        _ => sign(letter),
    }
}

fn digit(letter: char) -> (f32, &'static str) {
    match letter {
        '0' => (4.0, "M 0 -3.5 Q 0 -7 2 -7 Q 4 -7 4 -3.5 Q 4 0 2 0 Q 0 0 0 -3.5 Z"),
        '1' => (3.0, "M 0.5 -5.6 L 2.1 -7 V 0"),
        '2' => (4.0, "M 0.1 -5.2 Q 0.2 -7 2 -7 Q 3.8 -7 3.8 -5.2 Q 3.8 -4 2.6 -2.8 L 0 0 H 4"),
        '3' => (
            4.0,
            "M 0.2 -5.8 Q 0.7 -7 2 -7 Q 3.7 -7 3.7 -5.3 Q 3.7 -3.7 1.6 -3.7 Q 4 -3.7 4 -1.9 Q 4 0 2 0 Q 0.5 0 0 -1.3",
        ),
        '4' => (4.2, "M 3 0 V -7 L 0 -2.2 H 4.2"),
        '5' => (4.0, "M 3.6 -7 H 0.6 L 0.3 -3.9 Q 1 -4.5 2 -4.5 Q 4 -4.5 4 -2.3 Q 4 0 1.9 0 Q 0.5 0 0 -1.2"),
        '6' => (
            4.0,
            "M 3.5 -6.1 Q 3 -7 2 -7 Q 0 -7 0 -3 Q 0 0 2 0 Q 4 0 4 -2.2 Q 4 -4.3 2 -4.3 Q 0.3 -4.3 0 -2.4",
        ),
        '7' => (4.0, "M 0 -7 H 4 L 1.5 0"),
        '8' => (
            4.0,
            "M 2 -3.8 Q 0.3 -3.8 0.3 -5.4 Q 0.3 -7 2 -7 Q 3.7 -7 3.7 -5.4 Q 3.7 -3.8 2 -3.8 Q 0 -3.8 0 -1.9 Q 0 0 2 0 Q 4 0 4 -1.9 Q 4 -3.8 2 -3.8 Z",
        ),
        _ => (
            4.0,
            "M 0.5 -0.9 Q 1 0 2 0 Q 4 0 4 -4 Q 4 -7 2 -7 Q 0 -7 0 -4.8 Q 0 -2.7 2 -2.7 Q 3.7 -2.7 4 -4.6",
        ),
    }
}

fn small(letter: char) -> (f32, &'static str) {
    match letter {
        'a' => (4.0, "M 4 -5 V 0 M 4 -2.5 A 2 2.5 0 1 0 0 -2.5 A 2 2.5 0 1 0 4 -2.5"),
        'b' => (4.0, "M 0 -7.3 V 0 M 0 -2.5 A 2 2.5 0 1 1 4 -2.5 A 2 2.5 0 1 1 0 -2.5"),
        'c' => (3.6, "M 3.6 -4 A 2 2.5 0 1 0 3.6 -1"),
        'd' => (4.0, "M 4 -7.3 V 0 M 4 -2.5 A 2 2.5 0 1 0 0 -2.5 A 2 2.5 0 1 0 4 -2.5"),
        'e' => (4.0, "M 0 -2.5 H 4 A 2 2.5 0 1 0 3.6 -1"),
        'f' => (2.6, "M 2.8 -7.2 Q 1 -7.4 1 -5.5 V 0 M 0 -5 H 2.5"),
        'g' => {
            (4.0, "M 4 -5 V 0.4 Q 4 2 2 2 Q 0.8 2 0.4 1.5 M 4 -2.5 A 2 2.5 0 1 0 0 -2.5 A 2 2.5 0 1 0 4 -2.5")
        }
        'h' => (3.8, "M 0 -7.3 V 0 M 0 -3 Q 0 -5 2 -5 Q 3.8 -5 3.8 -3 V 0"),
        'i' => (0.0, "M 0 -5 V 0 M 0 -6.9 V -6.8"),
        'j' => (1.0, "M 1 -5 V 0.8 Q 1 2 0 2 M 1 -6.9 V -6.8"),
        'k' => (3.6, "M 0 -7.3 V 0 M 3.4 -5 L 0 -1.8 M 1.4 -3.1 L 3.6 0"),
        'l' => (0.0, "M 0 -7.3 V 0"),
        'm' => (6.0, "M 0 -5 V 0 M 0 -3 Q 0 -5 1.7 -5 Q 3 -5 3 -3 V 0 M 3 -3 Q 3 -5 4.7 -5 Q 6 -5 6 -3 V 0"),
        'n' => (3.8, "M 0 -5 V 0 M 0 -3 Q 0 -5 2 -5 Q 3.8 -5 3.8 -3 V 0"),
        'o' => (4.0, "M 0 -2.5 A 2 2.5 0 1 0 4 -2.5 A 2 2.5 0 1 0 0 -2.5"),
        'p' => (4.0, "M 0 -5 V 2 M 0 -2.5 A 2 2.5 0 1 1 4 -2.5 A 2 2.5 0 1 1 0 -2.5"),
        'q' => (4.0, "M 4 -5 V 2 M 4 -2.5 A 2 2.5 0 1 0 0 -2.5 A 2 2.5 0 1 0 4 -2.5"),
        'r' => (2.2, "M 0 -5 V 0 M 0 -3 Q 0.2 -5 2.2 -5"),
        's' => (
            3.2,
            "M 3 -4.2 Q 2.6 -5 1.6 -5 Q 0.1 -5 0.1 -3.8 Q 0.1 -2.8 1.6 -2.6 Q 3.2 -2.3 3.2 -1.2 Q 3.2 0 1.6 0 Q 0.4 0 0 -0.9",
        ),
        't' => (2.4, "M 1 -6.6 V -1.4 Q 1 0 2.4 0 M 0 -5 H 2.4"),
        'u' => (3.8, "M 0 -5 V -2 Q 0 0 1.8 0 Q 3.8 0 3.8 -2 M 3.8 -5 V 0"),
        'v' => (3.6, "M 0 -5 L 1.8 0 L 3.6 -5"),
        'w' => (5.6, "M 0 -5 L 1.4 0 L 2.8 -5 L 4.2 0 L 5.6 -5"),
        'x' => (3.4, "M 0 -5 L 3.4 0 M 3.4 -5 L 0 0"),
        'y' => (3.6, "M 0 -5 L 1.8 0 M 3.6 -5 L 1.4 1.2 Q 1 2 0 2"),
        _ => (3.4, "M 0 -5 H 3.2 L 0 0 H 3.4"),
    }
}

fn capital(letter: char) -> (f32, &'static str) {
    match letter {
        'A' => (5.0, "M 0 0 L 2.5 -7 L 5 0 M 0.9 -2.4 H 4.1"),
        'B' => (
            4.6,
            "M 0 0 V -7 H 2.4 Q 4.2 -7 4.2 -5.3 Q 4.2 -3.7 2.4 -3.7 H 0 M 2.4 -3.7 Q 4.6 -3.7 4.6 -1.9 Q 4.6 0 2.4 0 H 0",
        ),
        'C' => (5.0, "M 5 -5.4 Q 4.2 -7 2.8 -7 Q 0 -7 0 -3.5 Q 0 0 2.8 0 Q 4.2 0 5 -1.6"),
        'D' => (5.0, "M 0 0 V -7 H 2 Q 5 -7 5 -3.5 Q 5 0 2 0 Z"),
        'E' => (4.2, "M 4.2 -7 H 0 V 0 H 4.2 M 0 -3.7 H 3.6"),
        'F' => (4.0, "M 4.2 -7 H 0 V 0 M 0 -3.7 H 3.6"),
        'G' => (5.0, "M 5 -5.4 Q 4.2 -7 2.8 -7 Q 0 -7 0 -3.5 Q 0 0 2.8 0 Q 5 0 5 -2 V -3.2 H 3"),
        'H' => (4.8, "M 0 -7 V 0 M 4.8 -7 V 0 M 0 -3.7 H 4.8"),
        'I' => (0.0, "M 0 -7 V 0"),
        'J' => (3.0, "M 3 -7 V -2 Q 3 0 1.4 0 Q 0 0 0 -1.4"),
        'K' => (4.6, "M 0 -7 V 0 M 4.4 -7 L 0 -2.6 M 1.6 -4.2 L 4.6 0"),
        'L' => (4.0, "M 0 -7 V 0 H 4"),
        'M' => (6.0, "M 0 0 V -7 L 3 -1.5 L 6 -7 V 0"),
        'N' => (4.8, "M 0 0 V -7 L 4.8 0 V -7"),
        'O' => (5.4, "M 0 -3.5 Q 0 -7 2.7 -7 Q 5.4 -7 5.4 -3.5 Q 5.4 0 2.7 0 Q 0 0 0 -3.5 Z"),
        'P' => (4.5, "M 0 0 V -7 H 2.4 Q 4.5 -7 4.5 -5.1 Q 4.5 -3.2 2.4 -3.2 H 0"),
        'Q' => (
            5.4,
            "M 0 -3.5 Q 0 -7 2.7 -7 Q 5.4 -7 5.4 -3.5 Q 5.4 0 2.7 0 Q 0 0 0 -3.5 Z M 3.4 -1.6 L 5.4 0.6",
        ),
        'R' => (4.7, "M 0 0 V -7 H 2.4 Q 4.5 -7 4.5 -5.1 Q 4.5 -3.2 2.4 -3.2 H 0 M 2.4 -3.2 L 4.7 0"),
        'S' => (
            4.5,
            "M 4.2 -5.8 Q 3.6 -7 2.2 -7 Q 0.3 -7 0.3 -5.3 Q 0.3 -4 2.3 -3.6 Q 4.5 -3.1 4.5 -1.8 Q 4.5 0 2.2 0 Q 0.6 0 0 -1.4",
        ),
        'T' => (4.8, "M 0 -7 H 4.8 M 2.4 -7 V 0"),
        'U' => (4.8, "M 0 -7 V -2.4 Q 0 0 2.4 0 Q 4.8 0 4.8 -2.4 V -7"),
        'V' => (5.0, "M 0 -7 L 2.5 0 L 5 -7"),
        'W' => (7.2, "M 0 -7 L 1.8 0 L 3.6 -7 L 5.4 0 L 7.2 -7"),
        'X' => (4.6, "M 0 -7 L 4.6 0 M 4.6 -7 L 0 0"),
        'Y' => (4.8, "M 0 -7 L 2.4 -3.4 L 4.8 -7 M 2.4 -3.4 V 0"),
        _ => (4.6, "M 0 -7 H 4.4 L 0 0 H 4.6"),
    }
}

fn sign(letter: char) -> (f32, &'static str) {
    match letter {
        '.' => (0.2, "M 0.1 -0.1 V 0"),
        ',' => (0.6, "M 0.5 -0.2 L 0.1 1.2"),
        ':' => (0.2, "M 0.1 -0.3 V -0.2 M 0.1 -4 V -3.9"),
        ';' => (0.6, "M 0.5 -0.2 L 0.1 1.2 M 0.5 -4 V -3.9"),
        '·' => (0.2, "M 0.1 -2.9 V -2.8"),
        '-' | '–' => (2.6, "M 0 -2.8 H 2.6"),
        '_' => (4.0, "M 0 0.6 H 4"),
        '/' => (3.0, "M 0 0.8 L 3 -7.4"),
        '|' => (0.0, "M 0 -7.8 V 1.2"),
        '(' => (1.4, "M 1.4 -7.8 Q 0 -5.6 0 -3.2 Q 0 -0.8 1.4 1.4"),
        ')' => (1.4, "M 0 -7.8 Q 1.4 -5.6 1.4 -3.2 Q 1.4 -0.8 0 1.4"),
        '[' => (1.4, "M 1.4 -7.8 H 0 V 1.2 H 1.4"),
        ']' => (1.4, "M 0 -7.8 H 1.4 V 1.2 H 0"),
        '+' => (3.6, "M 0 -2.8 H 3.6 M 1.8 -4.6 V -1"),
        '=' => (3.4, "M 0 -3.8 H 3.4 M 0 -2 H 3.4"),
        '<' => (3.0, "M 3 -5 L 0 -2.8 L 3 -0.6"),
        '>' => (3.0, "M 0 -5 L 3 -2.8 L 0 -0.6"),
        '%' => (
            5.4,
            "M 4.4 -7 L 1 0 M 0 -5.6 A 1.2 1.4 0 1 0 2.4 -5.6 A 1.2 1.4 0 1 0 0 -5.6 M 3 -1.4 A 1.2 1.4 0 1 0 5.4 -1.4 A 1.2 1.4 0 1 0 3 -1.4",
        ),
        '#' => (4.4, "M 1.6 -6.6 L 0.8 -0.4 M 3.6 -6.6 L 2.8 -0.4 M 0.2 -4.6 H 4.4 M 0 -2.4 H 4.2"),
        '!' => (0.2, "M 0.1 -7 V -2 M 0.1 -0.1 V 0"),
        '?' => (3.4, "M 0 -5.6 Q 0.2 -7 1.7 -7 Q 3.4 -7 3.4 -5.4 Q 3.4 -4.2 1.7 -3.4 V -2 M 1.7 -0.1 V 0"),
        '\'' => (0.0, "M 0 -7.2 V -5.6"),
        '"' => (1.2, "M 0 -7.2 V -5.6 M 1.2 -7.2 V -5.6"),
        '*' => (3.0, "M 1.5 -6.6 V -3.4 M 0 -5.8 L 3 -4.2 M 3 -5.8 L 0 -4.2"),
        '→' => (5.0, "M 0 -2.8 H 5 M 3.4 -4.4 L 5 -2.8 L 3.4 -1.2"),
        _ => (3.6, "M 0 0 V -7 H 3.6 V 0 Z"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_printable_letter_has_its_own_shape() {
        let letters = ('a'..='z').chain('A'..='Z').chain('0'..='9').chain(".,:-_/()[]+=<>%#!?'\"*".chars());
        let mut shapes: Vec<&str> = letters.map(|letter| glyph(letter).1).collect();
        let count = shapes.len();
        shapes.sort_unstable();
        shapes.dedup();
        // Only the capital I and the small l may look alike, and they do not.
        assert_eq!(shapes.len(), count);
        assert!(!shapes.contains(&sign('\u{fffd}').1));
    }

    #[test]
    fn glyphs_move_only_in_x() {
        let mut data = String::new();
        push_shifted(&mut data, "M 0 -2.5 H 4 A 2 2.5 0 1 0 3.6 -1", 10.0);
        assert_eq!(data, "M10 -2.5 H14 A2 2.5 0 1 0 13.6 -1 ");
    }
}
