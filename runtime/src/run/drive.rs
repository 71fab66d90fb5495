//! The loop: wait, read, tick, publish. Nothing in it allocates, logs or blocks on another process.

use super::grid::Grid;
use super::live::Live;
use super::plan::{DriveError, DrivePlan, End, Pace};
use super::ports::Ports;
use super::rest::Rest;
use super::tally::Tally;
use nav_core::messages::{Header, Status};
use nav_core::tick::Tick;
use nav_host::stop::Stop;
use nav_ipc::clock::monotonic_ns;
use nav_model::alloc::{self, Counts};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::time::Duration;

/// How long to wait for a scan at once, so that a signal is seen.
const GLANCE: Duration = Duration::from_millis(50);
/// A writer that has gone is looked for when nothing was heard for this long, ns.
const LEFT_AFTER_NS: u64 = 20_000_000;

/// The state of a running loop.
struct Loop<'a, T> {
    ticker: &'a mut T,
    ports: &'a mut Ports,
    plan: &'a DrivePlan,
    stop: &'a Stop,
    live: &'a Live,
    tally: &'a mut Tally,
    period_ns: u64,
    step_max_m: f32,
    rest: Rest,
    status_seq: u64,
    heard_ns: u64,
    ends_ns: u64,
}

/// Drives until something ends it. The last command is zero, also after an error or a panic; after an abort or a
/// SIGKILL it is the driver that stops the robot, because commands no longer come.
///
/// Waits for a first scan, connects, arms, and from then on allocates nothing in this thread but for peers that
/// join or leave, which is counted apart.
///
/// # Errors
/// [`DriveError`]; the robot has been commanded to stop if shared memory still allows it.
pub fn drive<T: Tick>(
    ticker: &mut T,
    ports: &mut Ports,
    plan: &DrivePlan,
    stop: &Stop,
    live: &Live,
    tally: &mut Tally,
) -> Result<End, DriveError> {
    let task = *ticker.task();
    let period_ns = plan.period_ns.unwrap_or(task.control_period_ns());
    let mut running = Loop {
        period_ns,
        step_max_m: task.robot.linear_max_mps * task.control_period_s,
        ticker,
        ports,
        plan,
        stop,
        live,
        tally,
        rest: Rest::new(&task, period_ns),
        status_seq: 0,
        heard_ns: monotonic_ns(),
        ends_ns: u64::MAX,
    };
    let result = match catch_unwind(AssertUnwindSafe(|| running.arm_and_run())) {
        Ok(result) => result,
        Err(panic) => {
            // Whether it could be sent or not, the panic is what is to be told.
            let _ = running.bring_to_rest(true);
            resume_unwind(panic)
        }
    };
    let peer_left = matches!(result, Ok(End::PeerLeft));
    running.tally.close(monotonic_ns(), peer_left, running.step_max_m);
    // A simulator in lock-step is gone when it left; a robot may still roll by the last command.
    let at_rest = running.bring_to_rest(peer_left && plan.pace == Pace::Scan);
    let end = result?;
    at_rest?;
    Ok(end)
}

impl<T: Tick> Loop<'_, T> {
    fn arm_and_run(&mut self) -> Result<End, DriveError> {
        if let Some(end) = self.wait_for_first_scan()? {
            return Ok(end);
        }
        self.ports.refresh()?;
        let armed_ns = monotonic_ns();
        self.tally.armed_ns = armed_ns;
        if let Some(duration) = self.plan.duration {
            self.ends_ns = armed_ns.saturating_add(as_ns(duration));
        }
        let _forbidden = self.plan.assert_no_alloc.then(alloc::forbid);
        match self.plan.pace {
            Pace::Scan => self.run_by_scan(),
            Pace::Clock => self.run_by_clock(armed_ns),
        }
    }

    /// Waits for a scan to begin with. By the clock it is one that comes while we wait, because the grid starts from
    /// its arrival; one that lay there already does if no other follows within two periods.
    fn wait_for_first_scan(&mut self) -> Result<Option<End>, DriveError> {
        let started_ns = monotonic_ns();
        self.ports.wait(Duration::ZERO)?;
        let mut arrives = self.plan.pace == Pace::Scan;
        let mut follows_until_ns = u64::MAX;
        loop {
            let is_new = self.ports.read()?;
            let now_ns = monotonic_ns();
            if (is_new && arrives) || now_ns > follows_until_ns {
                break;
            }
            if is_new && follows_until_ns == u64::MAX {
                // A driver that does not notify never wakes us.
                follows_until_ns = now_ns + 2 * self.period_ns;
            }
            let waited_ns = now_ns - started_ns;
            if let Some(signal) = self.stop.signal() {
                return Ok(Some(End::StoppedWaiting(signal)));
            }
            if self.plan.idle_exit.is_some_and(|limit| waited_ns > as_ns(limit)) {
                return Err(DriveError::NoScan { seconds: waited_ns as f64 / 1e9 });
            }
            arrives |= self.ports.wait(GLANCE)?;
        }
        self.heard_ns = monotonic_ns();
        Ok(None)
    }

    fn run_by_scan(&mut self) -> Result<End, DriveError> {
        // The scan that came before arming is the first to be answered.
        let mut woken_ns = monotonic_ns();
        self.counted(|running| running.tick(woken_ns, true))?;
        loop {
            self.counted(|running| running.ports.wait(GLANCE))?;
            woken_ns = monotonic_ns();
            let is_new = self.read(woken_ns)?;
            if let Some(end) = self.reason_to_end(woken_ns)? {
                return Ok(end);
            }
            if is_new {
                self.counted(|running| running.tick(woken_ns, true))?;
                self.live.store_trouble(self.tally.overruns, self.tally.heap.allocations);
            }
        }
    }

    fn run_by_clock(&mut self, armed_ns: u64) -> Result<End, DriveError> {
        let mut grid = Grid::starting_with(armed_ns, self.period_ns);
        loop {
            let (woken_ns, arrived_ns) = self.counted(|running| running.wait_for_tick(&grid))?;
            let is_new = self.read(woken_ns)?;
            if let Some(end) = self.reason_to_end(woken_ns)? {
                return Ok(end);
            }
            self.tally.note_start(woken_ns);
            self.counted(|running| running.tick(woken_ns, is_new))?;
            let skipped = grid.advance(monotonic_ns(), arrived_ns);
            self.tally.note_skipped(skipped);
            self.live.store_trouble(self.tally.overruns, self.tally.heap.allocations);
        }
    }

    /// Waits until the window opens, then until a scan comes or the deadline has. Returns when it woke, and when the
    /// newest scan arrived, if one did: by our own clock, because a stamp says when it was made.
    fn wait_for_tick(&mut self, grid: &Grid) -> Result<(u64, Option<u64>), DriveError> {
        // What comes before the window opens is read anyway; it must not start the tick early.
        let came_early = self.ports.wait_until(grid.opens_ns())?;
        let early_ns = came_early.then(monotonic_ns);
        sleep_until(grid.opens_ns());
        self.ports.wait(Duration::ZERO)?;
        if self.ports.wait_until(grid.deadline_ns())? {
            let woken_ns = monotonic_ns();
            return Ok((woken_ns, Some(woken_ns)));
        }
        // A signal may have ended the wait.
        sleep_until(grid.deadline_ns());
        let woken_ns = monotonic_ns();
        self.tally.wake_late.record(woken_ns.saturating_sub(grid.deadline_ns()));
        Ok((woken_ns, early_ns))
    }

    /// Runs a part of the loop and adds what it did to the heap.
    fn counted<R>(&mut self, part: impl FnOnce(&mut Self) -> R) -> R {
        let (result, counts) = alloc::count(|| part(self));
        add(&mut self.tally.heap, counts);
        result
    }

    /// Connects to peers that joined or left; the one thing that may allocate, counted apart.
    fn refresh(&mut self) -> Result<(), DriveError> {
        let ports = &self.ports;
        let (result, counts) = alloc::permit(|| alloc::count(|| ports.refresh()));
        if counts != Counts::default() {
            self.tally.reconnects += 1;
            add(&mut self.tally.reconnect_heap, counts);
        }
        Ok(result?)
    }

    /// Takes in the newest messages; whether there was a new scan.
    fn read(&mut self, woken_ns: u64) -> Result<bool, DriveError> {
        self.refresh()?;
        let is_new = self.counted(|running| running.ports.read().map_err(DriveError::from))?;
        if is_new {
            self.heard_ns = woken_ns;
        }
        Ok(is_new)
    }

    fn tick(&mut self, woken_ns: u64, is_new: bool) -> Result<(), DriveError> {
        let inputs = self.ports.inputs();
        let began_ns = monotonic_ns();
        let now_ns = match self.plan.pace {
            Pace::Clock => began_ns,
            Pace::Scan => inputs.scan.header.stamp_ns,
        };
        let (command, status) = self.ticker.tick(now_ns, inputs);
        let decided_ns = monotonic_ns();
        self.ports.command(&command)?;
        let sent_ns = monotonic_ns();
        self.rest.note(&command, sent_ns);
        let tick_ns = sent_ns.saturating_sub(woken_ns);
        self.status_seq += 1;
        self.ports.status(&Status {
            header: Header { stamp_ns: now_ns, seq: self.status_seq },
            state: status.state as u32,
            faults: status.faults,
            goal_id: inputs.goal.id,
            subgoal_action: u32::try_from(status.action).unwrap_or(u32::MAX),
            subgoal_x_m: status.subgoal_m.0,
            subgoal_y_m: status.subgoal_m.1,
            wish_linear_mps: status.wish.linear_mps,
            wish_angular_radps: status.wish.angular_radps,
            scan_age_ns: inputs.scan.header.age_ns(now_ns),
            odom_age_ns: inputs.odom.header.age_ns(now_ns),
            policy_ns: decided_ns - began_ns,
            tick_ns,
            overruns: self.tally.overruns,
        })?;
        self.tally.tick.record(tick_ns);
        self.tally.controller.record(decided_ns - began_ns);
        if self.plan.pace == Pace::Clock && is_new {
            self.tally.note_answer(&inputs.scan.header, sent_ns);
        }
        self.tally.note(&inputs, &status, self.step_max_m);
        self.live.tell(&self.tally.causes);
        self.live.explain(&inputs, &status);
        self.live.store(&status, &command, tick_ns);
        Ok(())
    }

    fn reason_to_end(&self, now_ns: u64) -> Result<Option<End>, DriveError> {
        if let Some(signal) = self.stop.signal() {
            return Ok(Some(End::Stopped(signal)));
        }
        if now_ns >= self.ends_ns {
            return Ok(Some(End::Duration));
        }
        let silent_ns = now_ns.saturating_sub(self.heard_ns);
        if self.plan.exit_with_peer && silent_ns > LEFT_AFTER_NS && !self.ports.has_scan_writer() {
            return Ok(Some(End::PeerLeft));
        }
        match self.plan.idle_exit {
            Some(limit) if silent_ns > as_ns(limit) => {
                Err(DriveError::ScansStopped { seconds: silent_ns as f64 / 1e9 })
            }
            _ => Ok(None),
        }
    }

    /// Commands the robot to a stand: by a ramp, or at once when nobody drives by commands any more.
    fn bring_to_rest(&mut self, at_once: bool) -> Result<(), DriveError> {
        while self.rest.has_begun() {
            let now_ns = monotonic_ns();
            let command = self.rest.next(now_ns, at_once);
            self.ports.command(&command)?;
            self.rest.note(&command, now_ns);
            if self.rest.is_reached() {
                break;
            }
            std::thread::sleep(Duration::from_nanos(self.period_ns));
        }
        Ok(())
    }
}

fn add(sum: &mut Counts, counts: Counts) {
    sum.allocations += counts.allocations;
    sum.frees += counts.frees;
}

fn as_ns(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

/// Sleeps until a time of the monotonic clock, through signals.
fn sleep_until(deadline_ns: u64) {
    let deadline = libc::timespec {
        tv_sec: libc::time_t::try_from(deadline_ns / 1_000_000_000).unwrap_or(libc::time_t::MAX),
        tv_nsec: libc::c_long::try_from(deadline_ns % 1_000_000_000).unwrap_or_default(),
    };
    // SAFETY: a valid time; no remainder is asked for with an absolute deadline.
    while unsafe {
        libc::clock_nanosleep(
            libc::CLOCK_MONOTONIC,
            libc::TIMER_ABSTIME,
            &raw const deadline,
            std::ptr::null_mut(),
        )
    } == libc::EINTR
    {}
}
