//! The other process: publishes scans at a fixed rate and clocks the answers.

use super::{LoopBenchError, LoopBenchPlan, ROBOT, system};
use crate::run::histogram::{Histogram, Percentiles};
use crate::run::realtime::RealTime;
use nav_core::messages::{CmdVel, Goal, Header, LaserScan, Odometry};
use nav_core::task::Lidar;
use nav_ipc::clock::monotonic_ns;
use nav_ipc::{IpcConfig, IpcError, RobotName, RobotNode};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
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
    /// The model, for the geometry of its scans.
    pub model: PathBuf,
    /// Scans a second.
    pub rate_hz: f64,
    /// How long.
    pub seconds: f64,
    /// Whether to ask for real-time priority.
    pub realtime: bool,
}

/// A running peer.
#[derive(Debug)]
pub struct Peer(Child);

impl Peer {
    /// Starts this program again as a peer for one phase.
    pub(super) fn start(folder: &Path, plan: &LoopBenchPlan, realtime: bool) -> Result<Self, LoopBenchError> {
        let program = std::env::current_exe().map_err(system("this program cannot be found"))?;
        // Longer than the phase: the loop must not run out of scans.
        let seconds = plan.phase.as_secs_f64() + 0.5;
        let mut command = Command::new(program);
        command.arg(SUBCOMMAND).arg("--ipc-root").arg(folder).arg("--model").arg(&plan.model);
        command.args(["--rate", &plan.rate_hz.to_string(), "--seconds", &seconds.to_string()]);
        if realtime {
            command.arg("--realtime");
        }
        command.stdin(Stdio::null()).stdout(Stdio::piped());
        command.spawn().map(Self).map_err(system("the measuring peer cannot start"))
    }

    /// Waits for the peer's figures.
    pub(super) fn finish(self) -> Result<Percentiles, LoopBenchError> {
        let output = self.0.wait_with_output().map_err(system("the measuring peer was lost"))?;
        let text = String::from_utf8_lossy(&output.stdout);
        serde_json::from_str(&text).map_err(|error| LoopBenchError::Peer(format!("{error}: {text}")))
    }
}

/// Scans whose answers are waited for.
const REMEMBERED: usize = 256;
/// Before a scan is due, the peer stops listening for so long, ns.
const EARLY_NS: u64 = 300_000;

/// Why the peer failed.
#[derive(Debug, thiserror::Error)]
pub enum PeerError {
    /// The topics.
    #[error(transparent)]
    Ipc(#[from] IpcError),
}

/// What the peer does; returns scan to command in its own hands, ns, of every scan that was answered.
///
/// # Errors
/// The topics fail.
pub fn publish(plan: &PeerPlan, lidar: &Lidar) -> Result<Percentiles, PeerError> {
    let node = RobotNode::open(&RobotName::new(ROBOT)?, &IpcConfig::in_folder(&plan.ipc_root)?)?;
    let (scan_out, odom_out, goal_out) =
        (node.writer::<LaserScan>()?, node.writer::<Odometry>()?, node.writer::<Goal>()?);
    let command_in = node.reader::<CmdVel>()?;
    let wakeup = node.wakeup::<CmdVel>()?;
    let _granted = RealTime { priority: plan.realtime.then_some(PRIORITY), core: None }.enter();
    let mut scan = open_room(lidar);
    let mut command = CmdVel::default();
    let mut sent_ns = [0_u64; REMEMBERED];
    let mut round_trip = Histogram::default();
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
        scan_out.write(&scan)?;
        sent_ns[seq as usize % REMEMBERED] = stamp_ns;
        // An answer counts however late it comes; the wait only ends in time for the next scan.
        while wakeup.wait_until((deadline_ns + period_ns).saturating_sub(EARLY_NS))? {
            let answered = command.scan_seq;
            let is_new = command_in.read_latest(&mut command)? && command.scan_seq != answered;
            if is_new && seq.saturating_sub(command.scan_seq) < REMEMBERED as u64 {
                round_trip.record(monotonic_ns() - sent_ns[command.scan_seq as usize % REMEMBERED]);
            }
        }
    }
    Ok(round_trip.percentiles())
}

/// A scan of a room with something to steer round.
fn open_room(lidar: &Lidar) -> Box<LaserScan> {
    let mut scan = Box::new(LaserScan {
        angle_min_rad: lidar.angle_min_rad(),
        angle_increment_rad: lidar.angle_increment_rad(),
        range_min_m: lidar.range_min_m,
        range_max_m: lidar.range_max_m,
        beam_count: lidar.beam_count,
        ..LaserScan::default()
    });
    for (beam, range_m) in scan.ranges_m.iter_mut().enumerate() {
        *range_m = 1.5 + (beam % 7) as f32 * 0.3;
    }
    scan
}
