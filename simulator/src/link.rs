//! The simulated robot's side of the topics, and the two ways in which time passes.

use nav_core::driver_guard::DriverGuard;
use nav_core::messages::{CmdVel, Goal, Header, LaserScan, Odometry, RunState, Status, fault};
use nav_core::twist::Twist;
use nav_env::episode_loop::{Answer, Commands};
use nav_env::messages::{Messages, header};
use nav_host::stop::{Signal, Stop};
use nav_host::terminal::warn;
use nav_ipc::clock::monotonic_ns;
use nav_ipc::others::programs_of_other_users;
use nav_ipc::{IpcError, Reader, RobotName, RobotNode, Wakeup, Writer};
use nav_sim::simulation::Simulation;
use std::time::Duration;

use crate::cli::Pace;
use crate::plan::Plan;

/// How long to wait at once, so that Ctrl-C is seen.
const GLANCE: Duration = Duration::from_millis(100);
/// An unanswered scan is sent again after this, ns: a runtime that has just come may have missed it.
const REPEAT_NS: u64 = 300_000_000;

/// Why driving ended early.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LinkError {
    /// Asked to end.
    #[error("{0}")]
    Stopped(Signal),
    /// Nobody ever answered.
    #[error(
        "no runtime answered on robot `{robot}` within {seconds:.0} s: start `runtime --model DIR --robot {robot}` \
         with `--pace {pace}`, or wait longer with --wait"
    )]
    NoRuntime { robot: RobotName, seconds: f64, pace: &'static str },
    /// It stopped answering.
    #[error(
        "the runtime of robot `{robot}` has been silent for {seconds:.1} s and counts as gone; the robot was stopped"
    )]
    RuntimeGone { robot: RobotName, seconds: f64 },
    /// It answers lock-step scans by its own clock.
    #[error(
        "the runtime of robot `{robot}` keeps its own time and finds lock-step scans stale: start it with `--pace scan`"
    )]
    WrongPace { robot: RobotName },
    /// Shared memory.
    #[error(transparent)]
    Ipc(#[from] IpcError),
}

/// The topics of one robot, with whether and when its runtime last answered.
#[derive(Debug)]
pub(crate) struct Link {
    robot: RobotName,
    pace: Pace,
    period_ns: u64,
    wait_ns: u64,
    silence_ns: u64,
    scan_out: Writer<LaserScan>,
    odom_out: Writer<Odometry>,
    goal_out: Writer<Goal>,
    command_in: Reader<CmdVel>,
    status_in: Reader<Status>,
    wakeup: Wakeup,
    stop: Stop,
    driver: DriverGuard,
    seq: u64,
    last_stamp_ns: u64,
    /// First scan of this episode: commands that answer older ones belong to the last episode.
    episode_seq: u64,
    episodes_begun: u32,
    opened_ns: u64,
    heard_ns: Option<u64>,
    deadline_ns: u64,
    late_periods: u64,
    command: CmdVel,
    /// Of the newest command that counts in this episode.
    state: RunState,
    status: Status,
    messages: Messages,
    // Last: ports go before their node.
    _node: RobotNode,
}

impl Link {
    /// Opens the topics of the plan's robot.
    pub(crate) fn open(plan: &Plan, stop: Stop) -> Result<Self, LinkError> {
        let node = RobotNode::open(&plan.robot, &plan.ipc)?;
        if let Some(word) = programs_of_other_users(&plan.ipc) {
            warn(format_args!("simulator: {word}"));
        }
        let as_ns = |duration: Duration| u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        Ok(Self {
            robot: plan.robot.clone(),
            pace: plan.pace,
            period_ns: plan.task.control_period_ns(),
            wait_ns: as_ns(plan.wait),
            silence_ns: as_ns(plan.silence),
            scan_out: node.writer()?,
            odom_out: node.writer()?,
            goal_out: node.writer()?,
            command_in: node.reader()?,
            status_in: node.reader()?,
            wakeup: node.wakeup::<CmdVel>()?,
            stop,
            driver: DriverGuard::new(&plan.task),
            seq: 0,
            last_stamp_ns: 0,
            episode_seq: 1,
            episodes_begun: 0,
            opened_ns: monotonic_ns(),
            heard_ns: None,
            deadline_ns: 0,
            late_periods: 0,
            command: CmdVel::default(),
            state: RunState::default(),
            status: Status::default(),
            messages: Messages::default(),
            _node: node,
        })
    }

    /// The robot stands at the start of a new episode.
    pub(crate) fn restart(&mut self) {
        self.driver.restart();
        self.state = RunState::default();
        (self.episode_seq, self.episodes_begun) = (self.seq + 1, self.episodes_begun + 1);
        // Making a world and drawing a picture is no silence of the runtime's.
        self.heard_ns = self.heard_ns.map(|_| monotonic_ns());
    }

    /// Waits until somebody reads scan, odom and goal and writes cmd_vel.
    pub(crate) fn wait_for_runtime(&self) -> Result<(), LinkError> {
        loop {
            let readers =
                [self.scan_out.reader_count(), self.odom_out.reader_count(), self.goal_out.reader_count()];
            if readers.iter().all(|count| *count > 0) && self.command_in.writer_count() > 0 {
                return Ok(());
            }
            self.check_patience(monotonic_ns())?;
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// One scan, one command: waits for the answer, however long it takes within the patience.
    fn exchange_in_lockstep(
        &mut self,
        simulation: &mut Simulation,
        goal_id: u32,
    ) -> Result<Twist, LinkError> {
        self.seq += 1;
        let header = header(self.seq, self.episodes_begun, self.period_ns);
        self.publish(simulation, goal_id, header)?;
        let mut sent_ns = monotonic_ns();
        loop {
            self.wakeup.wait(GLANCE)?;
            let (is_accepted, now_ns) = self.take_command()?;
            if is_accepted && self.command.scan_seq == self.seq {
                if self.command.faults & fault::STALE_SCAN != 0 {
                    return Err(LinkError::WrongPace { robot: self.robot.clone() });
                }
                return Ok(self.driver.target(now_ns));
            }
            self.check_patience(now_ns)?;
            if now_ns - sent_ns > REPEAT_NS {
                self.publish(simulation, goal_id, header)?;
                sent_ns = now_ns;
            }
        }
    }

    /// A period of the clock. A command that comes within its first half acts in it, as on a base that obeys at
    /// once; later ones act in the next. Until the very first command the world stands still.
    fn exchange_in_real_time(
        &mut self,
        simulation: &mut Simulation,
        goal_id: u32,
    ) -> Result<Twist, LinkError> {
        loop {
            self.sleep_to_next_period();
            let started_ns = monotonic_ns();
            self.seq += 1;
            // The clock may be coarser than two steps; order must show in the stamps.
            self.last_stamp_ns = started_ns.max(self.last_stamp_ns + 1);
            self.publish(simulation, goal_id, Header { stamp_ns: self.last_stamp_ns, seq: self.seq })?;
            let cut_off_ns = started_ns + self.period_ns / 2;
            while monotonic_ns() < cut_off_ns {
                self.wakeup.wait_until(cut_off_ns)?;
                let (is_accepted, _) = self.take_command()?;
                if is_accepted && self.command.scan_seq == self.seq {
                    break;
                }
            }
            let now_ns = monotonic_ns();
            self.check_patience(now_ns)?;
            if self.heard_ns.is_some() {
                return Ok(self.driver.target(now_ns));
            }
        }
    }

    /// Absolute deadlines: late means whole periods are skipped and counted, never a burst.
    fn sleep_to_next_period(&mut self) {
        let now_ns = monotonic_ns();
        self.deadline_ns += self.period_ns;
        if self.deadline_ns < now_ns {
            if self.deadline_ns > self.period_ns {
                self.late_periods += (now_ns - self.deadline_ns) / self.period_ns + 1;
            }
            self.deadline_ns = now_ns;
        }
        std::thread::sleep(Duration::from_nanos(self.deadline_ns - now_ns));
    }

    fn publish(
        &mut self,
        simulation: &mut Simulation,
        goal_id: u32,
        header: Header,
    ) -> Result<(), LinkError> {
        self.messages.measure(simulation, goal_id, header);
        // The scan last: it wakes the runtime, which then finds the others.
        self.odom_out.write(&self.messages.odom)?;
        self.goal_out.write(&self.messages.goal)?;
        self.scan_out.write(&self.messages.scan)?;
        Ok(())
    }

    /// Reads the newest command: whether it is new and meant for this episode, and the time after reading.
    fn take_command(&mut self) -> Result<(bool, u64), LinkError> {
        let is_new = self.command_in.read_latest(&mut self.command)?;
        // Read after the command, so that an honest stamp is never in the future.
        let now_ns = monotonic_ns();
        if !is_new {
            return Ok((false, now_ns));
        }
        if self.pace == Pace::Realtime && !self.driver.is_fresh(&self.command, now_ns) {
            return Ok((false, now_ns));
        }
        self.heard_ns = Some(now_ns);
        let is_accepted =
            self.command.scan_seq >= self.episode_seq && self.driver.accept(&self.command, now_ns);
        if is_accepted {
            self.state = RunState::of(self.command.state).unwrap_or_default();
        }
        Ok((is_accepted, now_ns))
    }

    fn check_patience(&self, now_ns: u64) -> Result<(), LinkError> {
        if let Some(signal) = self.stop.signal() {
            return Err(LinkError::Stopped(signal));
        }
        let (since_ns, limit_ns) = match self.heard_ns {
            None => (self.opened_ns, self.wait_ns),
            Some(heard_ns) => (heard_ns, self.silence_ns),
        };
        if now_ns.saturating_sub(since_ns) <= limit_ns {
            return Ok(());
        }
        let (robot, seconds) = (self.robot.clone(), limit_ns as f64 / 1e9);
        Err(match self.heard_ns {
            None => LinkError::NoRuntime {
                robot,
                seconds,
                pace: if self.pace == Pace::Lockstep { "scan" } else { "clock" },
            },
            Some(_) => LinkError::RuntimeGone { robot, seconds },
        })
    }

    /// Id of the first goal: in real time a new one, so that a runtime that outlives a simulator notices the next.
    pub(crate) fn first_goal_id(&self) -> u32 {
        match self.pace {
            Pace::Lockstep => 1,
            Pace::Realtime => (self.opened_ns / 1_000_000) as u32,
        }
    }

    /// The guard on the driver's side.
    pub(crate) fn driver(&self) -> &DriverGuard {
        &self.driver
    }

    /// What the runtime last commanded.
    pub(crate) fn command(&self) -> &CmdVel {
        &self.command
    }

    /// What was sent last.
    pub(crate) fn messages(&self) -> &Messages {
        &self.messages
    }

    /// What the runtime last said it does.
    pub(crate) fn status(&self) -> &Status {
        &self.status
    }

    /// Periods that were skipped because this process was late.
    pub(crate) fn late_periods(&self) -> u64 {
        self.late_periods
    }
}

impl Commands for Link {
    type Error = LinkError;

    fn exchange(&mut self, simulation: &mut Simulation, goal_id: u32) -> Result<Answer, LinkError> {
        // A runtime that always answers leaves no other moment to notice.
        if let Some(signal) = self.stop.signal() {
            return Err(LinkError::Stopped(signal));
        }
        let command = match self.pace {
            Pace::Lockstep => self.exchange_in_lockstep(simulation, goal_id),
            Pace::Realtime => self.exchange_in_real_time(simulation, goal_id),
        }?;
        self.status_in.read_latest(&mut self.status)?;
        Ok(Answer { command, state: self.state })
    }
}
