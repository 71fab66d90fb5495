//! TensorBoard event files: TFRecord frames around `Event` messages of `tensorflow/core/util/event.proto`.
//!
//! A frame is the length (u64), its masked CRC-32C, the message, and the message's masked CRC-32C, all
//! little-endian.

use std::fs::File;
use std::io;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use prost::Message;

use super::RecordFile;

/// The part of `Event` that is written here.
#[derive(Clone, PartialEq, Message)]
struct Event {
    /// Seconds since 1970.
    #[prost(double, tag = "1")]
    wall_time: f64,
    #[prost(int64, tag = "2")]
    step: i64,
    #[prost(oneof = "What", tags = "3, 5, 7")]
    what: Option<What>,
}

#[derive(Clone, PartialEq, prost::Oneof)]
enum What {
    #[prost(string, tag = "3")]
    FileVersion(String),
    #[prost(message, tag = "5")]
    Summary(Summary),
    #[prost(message, tag = "7")]
    SessionLog(SessionLog),
}

#[derive(Clone, PartialEq, Message)]
struct Summary {
    #[prost(message, repeated, tag = "1")]
    value: Vec<Value>,
}

#[derive(Clone, PartialEq, Message)]
struct Value {
    #[prost(string, tag = "1")]
    tag: String,
    #[prost(float, optional, tag = "2")]
    simple_value: Option<f32>,
}

#[derive(Clone, PartialEq, Message)]
struct SessionLog {
    #[prost(int32, tag = "1")]
    status: i32,
}

/// `SessionLog.START`: points of earlier files at or after its step are discarded by TensorBoard.
const SESSION_START: i32 = 1;

/// How the names of event files begin; the second in which they were made follows.
const PREFIX: &str = "events.out.tfevents.";

/// An event file being written.
#[derive(Debug)]
pub struct EventFile {
    records: RecordFile,
}

impl EventFile {
    /// Starts a new event file in `folder`. TensorBoard shows all files of a folder as one run, and discards
    /// what earlier ones logged after `step`.
    ///
    /// # Errors
    /// When the file cannot be made or written.
    pub fn create(folder: &Path, step: u64) -> io::Result<Self> {
        let nanoseconds = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
        let (seconds, rest) = (nanoseconds / 1_000_000_000, nanoseconds % 1_000_000_000);
        let seconds = seconds.max(first_free_second(folder)?);
        let name = format!("{PREFIX}{seconds}.trainer.{}.{rest}", std::process::id());
        let mut file = Self { records: RecordFile::new(File::create_new(folder.join(name))?)? };
        file.append(0, What::FileVersion("brain.Event:2".to_owned()))?;
        // At step 0 too: a run that was killed before its first checkpoint starts again there.
        let first = if step > 0 { step + 1 } else { 0 };
        file.append(first, What::SessionLog(SessionLog { status: SESSION_START }))?;
        Ok(file)
    }

    /// Writes scalars of one step.
    ///
    /// # Errors
    /// When the file cannot be written; it stays readable.
    pub fn write(&mut self, step: u64, scalars: &[(&str, f64)]) -> io::Result<()> {
        let value =
            |(tag, value): &(&str, f64)| Value { tag: (*tag).to_owned(), simple_value: Some(*value as f32) };
        self.append(step, What::Summary(Summary { value: scalars.iter().map(value).collect() }))
    }

    fn append(&mut self, step: u64, what: What) -> io::Result<()> {
        let wall_time = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
        let step = i64::try_from(step).unwrap_or(i64::MAX);
        let message = Event { wall_time, step, what: Some(what) }.encode_to_vec();
        self.records.append(&frame(&message))
    }
}

/// The second after those in the names of all event files of a folder. TensorBoard reads them in the order of their
/// names, which must be that of their steps even if the clock was set back.
fn first_free_second(folder: &Path) -> io::Result<u128> {
    let mut free = 0;
    for entry in std::fs::read_dir(folder)? {
        let name = entry?.file_name();
        let after = name.to_str().and_then(|name| name.strip_prefix(PREFIX)?.split('.').next()?.parse().ok());
        free = free.max(after.map_or(0, |second: u128| second.saturating_add(1)));
    }
    Ok(free)
}

fn frame(message: &[u8]) -> Vec<u8> {
    let length = (message.len() as u64).to_le_bytes();
    let crc = |bytes| masked_crc32c(bytes).to_le_bytes();
    [&length[..], &crc(&length), message, &crc(message)].concat()
}

/// CRC-32C, rotated and offset as TFRecord wants it.
fn masked_crc32c(bytes: &[u8]) -> u32 {
    crc32c(bytes).rotate_right(15).wrapping_add(0xa282_ead8)
}

/// CRC with the Castagnoli polynomial, reflected; the messages are short.
fn crc32c(bytes: &[u8]) -> u32 {
    const POLYNOMIAL: u32 = 0x82f6_3b78;
    let crc = bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (POLYNOMIAL * (crc & 1)))
    });
    !crc
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_those_of_the_standards() {
        // RFC 3720, appendix B.4.
        assert_eq!(crc32c(&[0; 32]), 0x8a91_36aa);
        assert_eq!(crc32c(&[0xff; 32]), 0x62a8_ab43);
        assert_eq!(crc32c(b"123456789"), 0xe306_9283);
    }

    /// The events of a file, every frame checked.
    fn read(folder: &Path) -> Vec<Event> {
        let entry = std::fs::read_dir(folder).expect("the folder").next().expect("one file");
        let bytes = std::fs::read(entry.expect("readable").path()).expect("readable");
        let (mut rest, mut events) = (&bytes[..], Vec::new());
        while !rest.is_empty() {
            let (head, tail) = rest.split_at(12);
            let length = u64::from_le_bytes(head[..8].try_into().expect("eight bytes")) as usize;
            assert_eq!(head[8..], masked_crc32c(&head[..8]).to_le_bytes());
            let (message, tail) = tail.split_at(length);
            assert_eq!(tail[..4], masked_crc32c(message).to_le_bytes());
            events.push(Event::decode(message).expect("an event"));
            rest = &tail[4..];
        }
        events
    }

    #[test]
    fn a_run_that_starts_again_discards_everything_before() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        drop(EventFile::create(folder.path(), 0).expect("a file"));
        let start = Some(What::SessionLog(SessionLog { status: SESSION_START }));
        assert!(read(folder.path()).iter().any(|event| event.step == 0 && event.what == start));
    }

    #[test]
    fn a_resumed_file_says_where_it_starts_and_holds_the_scalars() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut file = EventFile::create(folder.path(), 500).expect("a file");
        file.write(501, &[("td3/q_mean", 1.5), ("success", 0.25)]).expect("written");
        let events = read(folder.path());
        assert_eq!(events[0].what, Some(What::FileVersion("brain.Event:2".to_owned())));
        assert_eq!(
            (events[1].step, &events[1].what),
            (501, &Some(What::SessionLog(SessionLog { status: 1 })))
        );
        let Some(What::Summary(summary)) = &events[2].what else { panic!("{events:?}") };
        let values: Vec<_> = summary.value.iter().map(|value| (&value.tag[..], value.simple_value)).collect();
        assert_eq!(values, [("td3/q_mean", Some(1.5)), ("success", Some(0.25))]);
        assert!(events.iter().all(|event| event.wall_time > 1e9));
    }

    #[test]
    fn a_clock_that_was_set_back_does_not_change_the_order_of_files() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let early = ["events.out.tfevents.4102444800.trainer.7.5", "events.out.tfevents.odd", "scalars.csv"];
        early.iter().for_each(|name| std::fs::write(folder.path().join(name), "").expect("written"));
        for made in 1..=2 {
            EventFile::create(folder.path(), 500).expect("a file");
            let entries = std::fs::read_dir(folder.path()).expect("the folder");
            let names =
                entries.map(|entry| entry.expect("readable").file_name().into_string().expect("text"));
            let newest = names.filter(|name| name.contains(".trainer.")).max().expect("some");
            let expected = format!("events.out.tfevents.{}.trainer.", 4_102_444_800_u64 + made);
            assert!(newest.starts_with(&expected), "{newest}");
        }
    }
}
