//! A line a second about the running loop, printed by a thread of its own: the loop only stores numbers.

use super::facts::{Fact, Facts};
use nav_core::guard::Cause;
use nav_core::messages::{CmdVel, RunState, fault};
use nav_core::shield::{Hazard, Intervention};
use nav_core::tick::{Inputs, TickStatus};
use nav_host::terminal::{self, Level};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The loop's newest numbers. Each is consistent in itself, not with the others.
#[derive(Debug, Default)]
pub struct Live {
    ticks: AtomicU64,
    overruns: AtomicU64,
    allocations: AtomicU64,
    state: AtomicU32,
    faults: AtomicU32,
    goal_distance_bits: AtomicU32,
    linear_bits: AtomicU32,
    angular_bits: AtomicU32,
    tick_max_ns: AtomicU64,
    /// The safety gate's newest act: its time in ms above two bits of what and how; 0 for none since it was told last.
    shielded: AtomicU64,
    shielded_bearing_bits: AtomicU32,
    /// How many causes the loop has met, and the newest that is not told yet.
    causes_met: AtomicU64,
    untold: Mutex<heapless::Deque<Cause, 8>>,
    facts: Facts,
}

impl Live {
    /// Hands over the causes that were met since the last call, to be told once each. Never waits: where the printer holds
    /// the queue, the next tick hands them over.
    pub fn tell(&self, causes: &[Cause]) {
        let met = self.causes_met.load(Relaxed) as usize;
        if met >= causes.len() {
            return;
        }
        if let Ok(mut untold) = self.untold.try_lock() {
            let handed = causes[met..].iter().take_while(|cause| untold.push_back(**cause).is_ok()).count();
            self.causes_met.store((met + handed) as u64, Relaxed);
        }
    }

    fn next_untold(&self) -> Option<Cause> {
        self.untold.lock().unwrap_or_else(PoisonError::into_inner).pop_front()
    }

    /// Hands over what helps to find a mistake, if anybody wants it; never waits either.
    pub fn explain(&self, inputs: &Inputs<'_>, status: &TickStatus) {
        if terminal::says(Level::Debug) {
            self.facts.meet(self.ticks.load(Relaxed) + 1, inputs, status);
        }
    }

    fn explanations(&self) -> impl Iterator<Item = Fact> {
        std::iter::from_fn(|| self.facts.next())
    }

    /// Stores what a tick did.
    pub fn store(&self, status: &TickStatus, command: &CmdVel, tick_ns: u64) {
        self.ticks.fetch_add(1, Relaxed);
        self.state.store(status.state as u32, Relaxed);
        self.faults.store(status.faults, Relaxed);
        self.goal_distance_bits.store(status.goal_distance_m.to_bits(), Relaxed);
        self.linear_bits.store(command.linear_mps.to_bits(), Relaxed);
        self.angular_bits.store(command.angular_radps.to_bits(), Relaxed);
        self.tick_max_ns.fetch_max(tick_ns, Relaxed);
        if let Some(Intervention { hazard, bearing_rad, in_s, is_forced }) = status.intervention {
            let what = 1 | u64::from(hazard == Hazard::Person) << 1 | u64::from(is_forced) << 2;
            self.shielded_bearing_bits.store(bearing_rad.to_bits(), Relaxed);
            self.shielded.store(what | ((1e3 * in_s) as u64) << 3, Relaxed);
        }
    }

    /// What the safety gate did since the last call, in words.
    fn shield_words(&self) -> String {
        let act = self.shielded.swap(0, Relaxed);
        if act == 0 {
            return String::new();
        }
        let intervention = Intervention {
            hazard: if act & 2 == 0 { Hazard::Standing } else { Hazard::Person },
            bearing_rad: f32::from_bits(self.shielded_bearing_bits.load(Relaxed)),
            in_s: (act >> 3) as f32 / 1e3,
            is_forced: act & 4 != 0,
        };
        format!("  {intervention}")
    }

    /// Stores what must not grow.
    pub fn store_trouble(&self, overruns: u64, allocations: u64) {
        self.overruns.store(overruns, Relaxed);
        self.allocations.store(allocations, Relaxed);
    }

    /// The line, for the time since the last one.
    fn line(&self, since_start: Duration, last_ticks: &mut u64, passed: Duration) -> String {
        let ticks = self.ticks.load(Relaxed);
        let rate_hz = ticks.saturating_sub(*last_ticks) as f64 / passed.as_secs_f64();
        *last_ticks = ticks;
        let number = |bits: &AtomicU32| f32::from_bits(bits.load(Relaxed));
        let what = match RunState::of(self.state.load(Relaxed)) {
            _ if ticks == 0 => "waiting for a scan".to_owned(),
            Some(state @ RunState::Driving) => {
                format!("{}, {:.1} m to the goal", state.name(), number(&self.goal_distance_bits))
            }
            state => state.unwrap_or_default().name().to_owned(),
        };
        format!(
            "{:5.0} s  {rate_hz:6.1} Hz  {what}  v {:.2} m/s  w {:+.2} rad/s  tick max {:.0} us  overruns {}  {}{}{}",
            since_start.as_secs_f64(),
            number(&self.linear_bits),
            number(&self.angular_bits),
            self.tick_max_ns.swap(0, Relaxed) as f64 / 1e3,
            self.overruns.load(Relaxed),
            fault::names(self.faults.load(Relaxed) & fault::STOPPING),
            self.shield_words(),
            match self.allocations.load(Relaxed) {
                0 => String::new(),
                count => format!("  ALLOCATIONS {count}"),
            }
        )
    }
}

/// The thread that prints; ends when dropped.
#[derive(Debug)]
pub struct Printer {
    thread: Option<JoinHandle<()>>,
    ended: Arc<std::sync::atomic::AtomicBool>,
}

impl Printer {
    /// Prints causes and facts from now on, with a line a second if asked to, as far as the program's level goes; where the
    /// system has no thread to spare, it says so and drives without.
    pub fn start(live: Arc<Live>, with_line: bool) -> Self {
        let ended = Arc::new(std::sync::atomic::AtomicBool::new(false));
        let seen = ended.clone();
        let print = move || {
            let started = Instant::now();
            let (mut last, mut last_ticks) = (started, 0);
            loop {
                std::thread::park_timeout(Duration::from_secs(1).saturating_sub(last.elapsed()));
                if seen.load(Relaxed) {
                    live.explanations().for_each(terminal::debug);
                    return;
                }
                let passed = last.elapsed();
                if passed >= Duration::from_secs(1) {
                    last = Instant::now();
                    while let Some(cause) = live.next_untold() {
                        terminal::warn(format_args!("runtime: {cause}"));
                    }
                    live.explanations().for_each(terminal::debug);
                    if with_line {
                        terminal::inform(live.line(started.elapsed(), &mut last_ticks, passed));
                    }
                }
            }
        };
        if !terminal::says(Level::Warn) {
            return Self { thread: None, ended };
        }
        let thread = std::thread::Builder::new().spawn(print);
        if let Err(error) = &thread {
            terminal::warn(format_args!("runtime: no thread for the live line ({error}), driving without"));
        }
        Self { thread: thread.ok(), ended }
    }
}

impl Drop for Printer {
    fn drop(&mut self) {
        self.ended.store(true, Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A printer that panicked has nothing to say that matters to the robot.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_says_what_happens() {
        let live = Live::default();
        let mut last = 0;
        let second = Duration::from_secs(1);
        assert!(live.line(second, &mut last, second).contains("waiting for a scan"));
        let status = TickStatus {
            state: RunState::Driving,
            goal_distance_m: 3.25,
            faults: fault::STALE_ODOM | fault::SPEED_LIMITED,
            intervention: Some(Intervention {
                hazard: Hazard::Person,
                bearing_rad: 1.2,
                in_s: 0.8,
                is_forced: false,
            }),
            ..TickStatus::default()
        };
        for _ in 0..10 {
            live.store(&status, &CmdVel { linear_mps: 0.5, ..CmdVel::default() }, 42_000);
        }
        let line = live.line(second, &mut last, second);
        for part in [
            "10.0 Hz",
            "driving, 3.2 m to the goal",
            "v 0.50",
            "max 42 us",
            "stale odometry",
            "shield: person from the left, 0.8 s",
        ] {
            assert!(line.contains(part), "{part} in {line}");
        }
        assert!(!line.contains("speed limited"), "what only shapes a command is no trouble: {line}");
        assert!(!line.contains("ALLOCATIONS"));
        live.store_trouble(2, 1);
        let line = live.line(second, &mut last, second);
        assert!(line.contains("overruns 2") && line.contains("ALLOCATIONS 1"), "{line}");
    }

    #[test]
    fn each_cause_is_told_once_and_in_order() {
        let live = Live::default();
        let causes = [Cause::Frozen { for_s: 1.0 }, Cause::StaleGoal { age_s: 2.0, limit_s: 1.0 }];
        live.tell(&causes[..1]);
        live.tell(&causes);
        live.tell(&causes);
        assert_eq!(live.next_untold(), Some(causes[0]));
        assert_eq!(live.next_untold(), Some(causes[1]));
        assert_eq!(live.next_untold(), None);
    }
}
