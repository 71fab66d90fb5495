//! The other process: publishes scans at a fixed rate and clocks the answers.

use super::child::Bound;
use super::{LoopBenchError, LoopBenchPlan, ROBOT, system};
use crate::latency::{Latencies, Percentiles};
use crate::run::realtime::RealTime;
use nav_core::messages::{CmdVel, Goal, Header, LaserScan, Odometry};
use nav_core::task::Lidar;
use nav_ipc::clock::monotonic_ns;
use nav_ipc::{IpcConfig, IpcError, RobotName, RobotNode};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// The hidden subcommand that the peer runs.
pub const SUBCOMMAND: &str = "loop-peer";
/// Above the loop's, so that the peer measures the loop and not itself.
const PRIORITY: u8 = 60;

/// What the peer is told.
#[derive(Clone, Debug)]
pub struct PeerPlan {
    /// Where the shared files live.
    pub ipc_root: PathBuf,
    /// Scans a second.
    pub rate_hz: f64,
    /// How long.
    pub seconds: f64,
    /// Whether to ask for real-time priority.
    pub realtime: bool,
}

/// A running peer.
#[derive(Debug)]
pub struct Peer(Bound);

impl Peer {
    /// Starts this program again as a peer for one phase.
    pub(super) fn start(folder: &Path, plan: &LoopBenchPlan, realtime: bool) -> Result<Self, LoopBenchError> {
        let program = std::env::current_exe().map_err(system("this program cannot be found"))?;
        // Longer than the phase: the loop must not run out of scans.
        let seconds = plan.phase.as_secs_f64() + 0.5;
        let mut command = Command::new(program);
        command.arg(SUBCOMMAND).arg("--ipc-root").arg(folder);
        // The model says the geometry of the scans.
        plan.demands.pass_on(&plan.model, &mut command);
        command.args(["--rate", &plan.rate_hz.to_string(), "--seconds", &seconds.to_string()]);
        if realtime {
            command.arg("--realtime");
        }
        command.stdin(Stdio::null()).stdout(Stdio::piped());
        Bound::spawn(&mut command).map(Self).map_err(system("the measuring peer cannot start"))
    }

    /// Waits for the peer's figures.
    pub(super) fn finish(self) -> Result<Answers, LoopBenchError> {
        let output = self.0.finish().map_err(system("the measuring peer was lost"))?;
        let text = String::from_utf8_lossy(&output.stdout);
        serde_json::from_str(&text).map_err(|error| LoopBenchError::Peer(format!("{error}: {text}")))
    }
}

/// What the peer saw of the answers.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Answers {
    /// From the scan's stamp to the command in the peer's hands, of every scan that was answered, however late.
    pub round_trip: Percentiles,
    /// Scans between the first and the last answered one that were never answered.
    pub unanswered: u64,
}

/// Scans whose answers are waited for.
const REMEMBERED: usize = 256;

/// Send times of the newest scans, and what became of them.
#[derive(Debug)]
struct Book {
    sent_ns: [u64; REMEMBERED],
    round_trip: Latencies,
    answered: u64,
    first_seq: Option<u64>,
    last_seq: u64,
}

impl Book {
    fn new() -> Self {
        let round_trip = Latencies::default();
        Self { sent_ns: [0; REMEMBERED], round_trip, answered: 0, first_seq: None, last_seq: 0 }
    }

    fn sent(&mut self, seq: u64, stamp_ns: u64) {
        self.sent_ns[seq as usize % REMEMBERED] = stamp_ns;
    }

    /// A command that answers `scan_seq` is here; each scan counts once. `newest_seq` was sent last.
    fn answer(&mut self, scan_seq: u64, newest_seq: u64, now_ns: u64) {
        if scan_seq <= self.last_seq || scan_seq > newest_seq {
            return;
        }
        self.first_seq.get_or_insert(scan_seq);
        (self.last_seq, self.answered) = (scan_seq, self.answered + 1);
        if newest_seq - scan_seq < REMEMBERED as u64 {
            self.round_trip.record(now_ns.saturating_sub(self.sent_ns[scan_seq as usize % REMEMBERED]));
        }
    }

    fn finish(&self) -> Answers {
        let span = self.first_seq.map_or(0, |first_seq| self.last_seq + 1 - first_seq);
        Answers { round_trip: self.round_trip.percentiles(), unanswered: span - self.answered }
    }
}

/// Before a scan is due, the peer stops listening for so long, ns.
const EARLY_NS: u64 = 300_000;

/// Why the peer failed.
#[derive(Debug, thiserror::Error)]
pub enum PeerError {
    /// The topics.
    #[error(transparent)]
    Ipc(#[from] IpcError),
}

/// What the peer does; returns what it saw.
///
/// # Errors
/// The topics fail.
pub fn publish(plan: &PeerPlan, lidar: &Lidar) -> Result<Answers, PeerError> {
    let node = RobotNode::open(&RobotName::new(ROBOT)?, &IpcConfig::in_folder(&plan.ipc_root)?)?;
    let (scan_out, odom_out, goal_out) =
        (node.writer::<LaserScan>()?, node.writer::<Odometry>()?, node.writer::<Goal>()?);
    let command_in = node.reader::<CmdVel>()?;
    let wakeup = node.wakeup::<CmdVel>()?;
    let _granted = RealTime { priority: plan.realtime.then_some(PRIORITY), core: None }.enter();
    let mut scan = open_room(lidar);
    let mut command = CmdVel::default();
    let mut book = Book::new();
    let period_ns = (1e9 / plan.rate_hz) as u64;
    let started_ns = monotonic_ns();
    let ends_ns = started_ns + (plan.seconds * 1e9) as u64;
    let mut deadline_ns = started_ns;
    for seq in 1.. {
        deadline_ns = (deadline_ns + period_ns).max(monotonic_ns());
        std::thread::sleep(Duration::from_nanos(deadline_ns - monotonic_ns().min(deadline_ns)));
        let stamp_ns = monotonic_ns();
        if stamp_ns > ends_ns {
            break;
        }
        let header = Header { stamp_ns, seq };
        scan.header = header;
        odom_out.write(&Odometry { header, ..Odometry::default() })?;
        // A new goal every five seconds keeps the high level deciding.
        let id = ((stamp_ns - started_ns) / 5_000_000_000) as u32 + 1;
        goal_out.write(&Goal { header, x_m: 4.0, y_m: 1.0, radius_m: 0.3, id })?;
        book.sent(seq, stamp_ns);
        scan_out.write(&scan)?;
        // An answer counts however late it comes; the wait only ends in time for the next scan.
        while wakeup.wait_until((deadline_ns + period_ns).saturating_sub(EARLY_NS))? {
            if command_in.read_latest(&mut command)? {
                book.answer(command.scan_seq, seq, monotonic_ns());
            }
        }
    }
    Ok(book.finish())
}

/// A scan of a room with something to steer round.
fn open_room(lidar: &Lidar) -> Box<LaserScan> {
    let mut scan = Box::new(LaserScan::of(lidar, |_| 0.0));
    for (beam, range_m) in scan.ranges_m.iter_mut().enumerate() {
        *range_m = 1.5 + (beam % 7) as f32 * 0.3;
    }
    scan
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_answers_count_and_missing_ones_are_counted() {
        let mut book = Book::new();
        for seq in 1..=8 {
            book.sent(seq, 100 * seq);
        }
        // The first scan came before the loop was ready, the last after it had ended: neither is missing.
        for (scan_seq, now_ns) in [(2, 210), (2, 290), (3, 750), (6, 770), (7, 780)] {
            book.answer(scan_seq, 8, now_ns);
        }
        let answers = book.finish();
        assert_eq!(answers.unanswered, 2, "four and five");
        assert_eq!((answers.round_trip.count, answers.round_trip.max_ns), (4, 450));
        assert_eq!(Book::new().finish().unanswered, 0);
    }
}
