//! The keys of a description with their values as text, and the lines in which they stand.

use super::MapError;
use saphyr_parser::{Event, Parser, StrInput};
use std::path::Path;

/// The keys of a description, in the order of the file.
pub(super) struct Keys<'a> {
    path: &'a Path,
    entries: Vec<Entry>,
}

pub(super) struct Entry {
    pub(super) key: String,
    /// Counted from 1.
    pub(super) line: usize,
    value: Value,
}

enum Value {
    One(String),
    List(Vec<String>),
    /// Mappings, lists of lists, and references, which no key of a map has.
    Nested,
}

impl<'a> Keys<'a> {
    pub(super) fn read(path: &'a Path, text: &str) -> Result<Self, MapError> {
        let mut events = Events { path, parser: Parser::new_from_str(text) };
        let (first, line) =
            events.after(|event| matches!(event, Event::StreamStart | Event::DocumentStart(_)))?;
        if !matches!(first, Event::MappingStart(..)) {
            return Err(events.wrong(line, "expected the keys of a map, such as `image: map.pgm`"));
        }
        let mut entries: Vec<Entry> = Vec::new();
        loop {
            let (key, line) = match events.next()? {
                (Event::MappingEnd, _) => break,
                (Event::Scalar(key, ..), line) => (key.into_owned(), line),
                (_, line) => return Err(events.wrong(line, "expected `key: value`")),
            };
            if entries.iter().any(|entry| entry.key == key) {
                return Err(events.wrong(line, format!("`{key}` stands here a second time")));
            }
            entries.push(Entry { key, line, value: events.value()? });
        }
        match events.after(|event| matches!(event, Event::DocumentEnd))? {
            (Event::StreamEnd, _) => Ok(Self { path, entries }),
            (_, line) => Err(events.wrong(line, "a second document begins here: a map has one")),
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Entry> {
        self.entries.iter()
    }

    /// An error in the line of a key.
    pub(super) fn wrong<T>(&self, key: &str, message: impl Into<String>) -> Result<T, MapError> {
        let line = self.find(key).map_or(1, |entry| entry.line);
        Err(MapError::Syntax { path: self.path.to_owned(), line, message: message.into() })
    }

    pub(super) fn text(&self, key: &'static str) -> Result<&str, MapError> {
        match &self.required(key)?.value {
            Value::One(text) => Ok(text),
            _ => self.wrong(key, format!("`{key}` needs one value")),
        }
    }

    pub(super) fn optional_text(&self, key: &'static str) -> Result<Option<&str>, MapError> {
        self.find(key).map(|_| self.text(key)).transpose()
    }

    pub(super) fn number(&self, key: &'static str) -> Result<f32, MapError> {
        self.parsed(key, self.text(key)?)
    }

    pub(super) fn optional_number(&self, key: &'static str) -> Result<Option<f32>, MapError> {
        self.find(key).map(|_| self.number(key)).transpose()
    }

    /// Three numbers in a list.
    pub(super) fn three_numbers(&self, key: &'static str) -> Result<[f32; 3], MapError> {
        match &self.required(key)?.value {
            Value::List(texts) if texts.len() == 3 => {
                let mut numbers = [0.0; 3];
                for (number, text) in numbers.iter_mut().zip(texts) {
                    *number = self.parsed(key, text)?;
                }
                Ok(numbers)
            }
            _ => self.wrong(key, format!("`{key}` needs three numbers: [x, y, yaw]")),
        }
    }

    fn find(&self, key: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.key == key)
    }

    fn required(&self, key: &'static str) -> Result<&Entry, MapError> {
        self.find(key).ok_or_else(|| MapError::MissingKey { path: self.path.to_owned(), key })
    }

    fn parsed(&self, key: &str, text: &str) -> Result<f32, MapError> {
        match text.parse::<f32>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => self.wrong(key, format!("`{key}` needs a number, not {text:?}")),
        }
    }
}

/// The events of the parser, each with its line.
struct Events<'a, 'text> {
    path: &'a Path,
    parser: Parser<'text, StrInput<'text>>,
}

impl<'text> Events<'_, 'text> {
    fn next(&mut self) -> Result<(Event<'text>, usize), MapError> {
        match self.parser.next() {
            Some(Ok((event, span))) => Ok((event, span.start.line())),
            Some(Err(error)) => {
                Err(self.wrong(error.marker().line(), format!("this is not YAML: {}", error.info())))
            }
            None => Ok((Event::StreamEnd, 1)),
        }
    }

    /// The first event that is none of those to skip.
    fn after(&mut self, skipped: impl Fn(&Event) -> bool) -> Result<(Event<'text>, usize), MapError> {
        loop {
            let next = self.next()?;
            if !skipped(&next.0) {
                return Ok(next);
            }
        }
    }

    /// The value of a key, whole.
    fn value(&mut self) -> Result<Value, MapError> {
        let mut texts = Vec::new();
        match self.next()?.0 {
            Event::Scalar(text, ..) => return Ok(Value::One(text.into_owned())),
            Event::SequenceStart(..) => {}
            Event::MappingStart(..) => return self.nested(1),
            _ => return Ok(Value::Nested),
        }
        loop {
            match self.next()?.0 {
                Event::Scalar(text, ..) => texts.push(text.into_owned()),
                Event::SequenceEnd => return Ok(Value::List(texts)),
                Event::SequenceStart(..) | Event::MappingStart(..) => return self.nested(2),
                _ => return self.nested(1),
            }
        }
    }

    /// Skips the rest of what is open.
    fn nested(&mut self, mut open: u32) -> Result<Value, MapError> {
        while open > 0 {
            match self.next()?.0 {
                Event::SequenceStart(..) | Event::MappingStart(..) => open += 1,
                Event::SequenceEnd | Event::MappingEnd => open -= 1,
                _ => {}
            }
        }
        Ok(Value::Nested)
    }

    fn wrong(&self, line: usize, message: impl Into<String>) -> MapError {
        MapError::Syntax { path: self.path.to_owned(), line, message: message.into() }
    }
}
