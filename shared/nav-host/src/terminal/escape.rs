//! Text from files may hold commands to the terminal: to retitle it, to clear it, to write over what stands there.

/// The text with its control characters, and what turns the direction of writing, as `\u{1b}`: visible and harmless.
/// Line breaks and tabs stay.
pub fn escaped(text: &str) -> String {
    // A line break of another system is one.
    with(&text.replace("\r\n", "\n"), |letter| letter != '\n' && letter != '\t')
}

/// As [`escaped`], line breaks and tabs too: a name that cannot pass for a line of its own.
pub fn one_line(text: &str) -> String {
    with(text, |_| true)
}

fn with(text: &str, counts: impl Fn(char) -> bool) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        if commands(letter) && counts(letter) {
            escaped.extend(letter.escape_unicode());
        } else {
            escaped.push(letter);
        }
    }
    escaped
}

/// C0, DEL and C1, line and paragraph separators, and the marks of writing direction.
fn commands(letter: char) -> bool {
    letter.is_control()
        || matches!(letter, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_to_a_terminal_become_visible() {
        let title = "\u{1b}]0;owned\u{7}maze\u{1b}[2J\u{9b}31m\r";
        let seen = "\\u{1b}]0;owned\\u{7}maze\\u{1b}[2J\\u{9b}31m\\u{d}";
        assert_eq!(escaped(title), seen);
        assert_eq!(one_line(title), seen);
        assert_eq!(escaped("\u{202e}txt"), "\\u{202e}txt");
    }

    #[test]
    fn what_people_write_stays() {
        assert_eq!(escaped("Büro 2. OG: →\t1 m\r\n\n"), "Büro 2. OG: →\t1 m\n\n");
        assert_eq!(one_line("two\nlines\t"), "two\\u{a}lines\\u{9}");
    }
}
