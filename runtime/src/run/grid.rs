//! Absolute deadlines at a fixed rate, kept in phase with the scans.
//!
//! A tick happens when a scan arrives within the window before its deadline, or else at the deadline. The grid
//! moves by a small part of the measured difference, so that scans come to lie in the middle of the window:
//! data are then as fresh as on an event, and a missing scan still cannot delay a tick. Late means that whole
//! periods are skipped and counted, never made up for in a burst.

/// The window before a deadline in which a scan starts the tick: a share of the period...
const WINDOW_SHARE: u64 = 8;
/// ...but not longer than this, ns.
const WINDOW_MAX_NS: u64 = 5_000_000;
/// The grid follows the scans by this share of the difference...
const FOLLOW_SHARE: i64 = 4;
/// ...but by no more than this share of a period.
const FOLLOW_MAX_SHARE: i64 = 32;

/// The deadlines of the ticks, one after the other. All times are of one monotonic clock, ns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    period_ns: u64,
    deadline_ns: u64,
}

impl Grid {
    /// A grid whose first tick answers the scan one period after the one that arrived at `scan_ns`.
    pub fn starting_with(scan_ns: u64, period_ns: u64) -> Self {
        let mut grid = Self { period_ns, deadline_ns: 0 };
        grid.deadline_ns = scan_ns + period_ns + grid.window_ns() / 2;
        grid
    }

    fn window_ns(&self) -> u64 {
        (self.period_ns / WINDOW_SHARE).min(WINDOW_MAX_NS)
    }

    /// From here on a scan starts the tick.
    pub fn opens_ns(&self) -> u64 {
        self.deadline_ns - self.window_ns()
    }

    /// Here the tick starts without one.
    pub fn deadline_ns(&self) -> u64 {
        self.deadline_ns
    }

    /// Goes on to the next period after a tick that ended at `finished_ns` and used a new scan that arrived at
    /// `scan_ns`, if any. Returns how many whole periods are skipped because it is late.
    pub fn advance(&mut self, finished_ns: u64, scan_ns: Option<u64>) -> u64 {
        let follow_ns = scan_ns.map_or(0, |scan_ns| self.follow_ns(scan_ns));
        self.deadline_ns = self.deadline_ns.saturating_add_signed(follow_ns) + self.period_ns;
        let skipped = if finished_ns >= self.deadline_ns {
            (finished_ns - self.deadline_ns) / self.period_ns + 1
        } else {
            0
        };
        self.deadline_ns += skipped * self.period_ns;
        skipped
    }

    /// How far to move towards a scan: within half a period it does not matter which tick it belongs to.
    fn follow_ns(&self, scan_ns: u64) -> i64 {
        let signed = |value: u64| i64::try_from(value).unwrap_or(i64::MAX);
        let period_ns = signed(self.period_ns);
        let ideal_ns = signed(scan_ns + self.window_ns() / 2);
        let half_ns = period_ns / 2;
        let difference_ns = (ideal_ns - signed(self.deadline_ns) + half_ns).rem_euclid(period_ns) - half_ns;
        let most_ns = period_ns / FOLLOW_MAX_SHARE;
        (difference_ns / FOLLOW_SHARE).clamp(-most_ns, most_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: u64 = 10_000_000;

    #[test]
    fn without_scans_the_rate_is_exact() {
        let mut grid = Grid::starting_with(0, PERIOD_NS);
        let first_ns = grid.deadline_ns();
        for tick in 1..=1000 {
            assert_eq!(grid.advance(grid.deadline_ns() + 100, None), 0);
            assert_eq!(grid.deadline_ns(), first_ns + tick * PERIOD_NS);
        }
    }

    #[test]
    fn late_ticks_skip_whole_periods_and_keep_the_phase() {
        let mut grid = Grid::starting_with(0, PERIOD_NS);
        let phase_ns = grid.deadline_ns() % PERIOD_NS;
        let late_ns = grid.deadline_ns() + 3 * PERIOD_NS + PERIOD_NS / 2;
        assert_eq!(grid.advance(late_ns, None), 3, "the three deadlines that passed");
        assert!(grid.deadline_ns() > late_ns && grid.deadline_ns() <= late_ns + PERIOD_NS);
        assert_eq!(grid.deadline_ns() % PERIOD_NS, phase_ns);
    }

    #[test]
    fn the_grid_finds_the_scans_from_any_phase() {
        for phase_ns in (0..PERIOD_NS).step_by(777_777) {
            let mut grid = Grid::starting_with(0, PERIOD_NS);
            let mut in_window = 0;
            for tick in 0..200_u64 {
                // The newest scan before the deadline; it starts the tick if it lies in the window.
                let deadline_ns = grid.deadline_ns();
                let scan_ns = (deadline_ns - phase_ns) / PERIOD_NS * PERIOD_NS + phase_ns;
                in_window = if scan_ns >= grid.opens_ns() { in_window + 1 } else { 0 };
                let woken_ns = if scan_ns >= grid.opens_ns() { scan_ns } else { deadline_ns };
                assert_eq!(grid.advance(woken_ns + 1000, Some(scan_ns)), 0, "tick {tick}");
            }
            assert!(in_window > 100, "phase {phase_ns}: in the window for the last {in_window} ticks");
        }
    }

    #[test]
    fn scans_at_another_rate_do_not_change_ours_by_much() {
        let mut grid = Grid::starting_with(0, PERIOD_NS);
        let first_ns = grid.deadline_ns();
        for _ in 0..1000 {
            let deadline_ns = grid.deadline_ns();
            let scan_ns = deadline_ns / 3_700_000 * 3_700_000;
            grid.advance(deadline_ns + 1000, Some(scan_ns));
        }
        let mean_ns = (grid.deadline_ns() - first_ns) / 1000;
        assert!(mean_ns.abs_diff(PERIOD_NS) < PERIOD_NS / 20, "{mean_ns}");
    }
}
