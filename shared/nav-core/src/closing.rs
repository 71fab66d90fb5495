//! Closing speeds: what comes nearer, sector by sector, beyond what the robot's own motion explains.

use core::f32::consts::{PI, TAU};

use crate::geometry::{Pose, wrap_angle};
use crate::history::History;
use crate::observation::{CHANGE_S, CHANGE_TICKS};
use crate::scale::Scale;
use crate::scan::{SECTOR_COUNT, ScanGeometry, ScanView};
use crate::task::Task;

/// Closing speeds below this are noise, m/s of the reference robot ([`Scale`]).
const LEAST_MPS: f32 = 0.3;
/// What seems to come faster than this counts as this fast, m/s of the reference robot.
const MOST_MPS: f32 = 3.0;
/// A gap closes at least so fast, m/s of the reference robot.
const SLOWEST_MPS: f32 = 0.05;
/// Width of a sector, rad.
const PER_SECTOR_RAD: f32 = TAU / SECTOR_COUNT as f32;

/// Closing speed of every sector, from the scans of the last [`CHANGE_S`].
#[derive(Clone, Debug)]
pub(crate) struct ClosingSpeeds {
    scale: Scale,
    /// Sector ranges, and where they were seen from.
    seen: History<([f32; SECTOR_COUNT], Pose), CHANGE_TICKS>,
    /// Between the newest and the oldest of them, s.
    span_s: f32,
    closing_mps: [f32; SECTOR_COUNT],
}

impl ClosingSpeeds {
    /// Nothing seen yet.
    pub(crate) fn new(task: &Task) -> Self {
        let scale = task.scale();
        let ticks = task.ticks(scale.s(CHANGE_S));
        Self {
            scale,
            seen: History::new(ticks, ([0.0; SECTOR_COUNT], Pose::default())),
            span_s: ticks as f32 * task.control_period_s,
            closing_mps: [0.0; SECTOR_COUNT],
        }
    }

    /// Forgets the past: nothing closes in until two different scans were seen.
    pub(crate) fn restart(&mut self, scan: &ScanView, pose: Pose) {
        self.seen.fill((*scan.sectors_m(), pose));
        self.closing_mps.fill(0.0);
    }

    /// Takes in the next tick's scan, seen from `pose`.
    pub(crate) fn update(&mut self, geometry: &ScanGeometry, scan: &ScanView, pose: Pose) {
        self.seen.push((*scan.sectors_m(), pose));
        self.measure(geometry, scan.reach_m());
    }

    /// A sector closes in at the range seen in its direction `span_s` ago, carried forward by the robot's
    /// displacement, less its range now, divided by `span_s`. Beyond the lidar's range nothing is known, so that
    /// free space left behind does not close in.
    fn measure(&mut self, geometry: &ScanGeometry, reach_m: f32) {
        let ((ranges_m, now), (before, then)) = (self.seen.newest(), self.seen.oldest());
        let (least_mps, most_mps) = (self.scale.mps(LEAST_MPS), self.scale.mps(MOST_MPS));
        let moved = now.position() - then.position();
        let shift = libm::roundf((now.yaw_rad - then.yaw_rad) / PER_SECTOR_RAD) as i32;
        // The displacement in the robot frame, so that the sectors' own directions serve.
        let (sin, cos) = libm::sincosf(now.yaw_rad);
        let (ahead_m, left_m) = (moved.x * cos + moved.y * sin, moved.y * cos - moved.x * sin);
        let first = shift.rem_euclid(SECTOR_COUNT as i32) as usize;
        for (sector, &(dir_x, dir_y)) in geometry.sector_directions().iter().enumerate() {
            let from = first + sector;
            let at = |index: usize| before[index % SECTOR_COUNT];
            // The nearest of three sectors then: an edge that slid by a sector is not a person.
            let nearest_m = at(from + SECTOR_COUNT - 1).min(at(from)).min(at(from + 1));
            let expected_m = (nearest_m - ahead_m * dir_x - left_m * dir_y).min(reach_m);
            let closing = (expected_m - ranges_m[sector]) / self.span_s;
            self.closing_mps[sector] = if closing > least_mps { closing.min(most_mps) } else { 0.0 };
        }
    }

    /// The fastest closing speed within a sector of `bearing_rad` (robot frame), m/s.
    pub(crate) fn towards_mps(&self, bearing_rad: f32) -> f32 {
        let at = libm::floorf((wrap_angle(bearing_rad) + PI) / PER_SECTOR_RAD) as i32;
        (at - 1..=at + 1).fold(0.0, |most: f32, sector| {
            most.max(self.closing_mps[sector.rem_euclid(SECTOR_COUNT as i32) as usize])
        })
    }

    /// Time until the first thing that closes in touches the footprint of a robot that keeps `linear_mps`,
    /// if nobody yields, s; infinite when nothing does.
    pub(crate) fn time_to_contact_s(&self, geometry: &ScanGeometry, linear_mps: f32) -> f32 {
        let (ranges_m, _) = self.seen.newest();
        let slowest_mps = self.scale.mps(SLOWEST_MPS);
        let mut soonest_s = f32::INFINITY;
        for (sector, &closing) in self.closing_mps.iter().enumerate() {
            if closing > 0.0 {
                let own = linear_mps * geometry.sector_directions()[sector].0;
                let gap_m = (ranges_m[sector] - geometry.reach_m()[sector]).max(0.0);
                soonest_s = soonest_s.min(gap_m / (closing + own).max(slowest_mps));
            }
        }
        soonest_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::LaserScan;
    use crate::task::Task;

    const STEP_S: f32 = 0.1;

    /// Ten steps of a robot that drives ahead at 1 m/s while something ahead is `gap_m(step)` away.
    fn driven(gap_m: impl Fn(f32) -> f32) -> ClosingSpeeds {
        let task = Task::default();
        let geometry = ScanGeometry::new(&task);
        let (mut view, mut closing) = (ScanView::new(&geometry), ClosingSpeeds::new(&task));
        for step in 0..10_u8 {
            let ahead = |angle: f32| if angle.abs() < 0.3 { gap_m(f32::from(step)) } else { f32::INFINITY };
            let scan = LaserScan::of(&task.lidar, ahead);
            view.update(&geometry, scan.ranges_m(), scan.range_max_m);
            let pose = Pose::new(f32::from(step) * STEP_S, 0.0, 0.0);
            if step == 0 { closing.restart(&view, pose) } else { closing.update(&geometry, &view, pose) }
        }
        closing
    }

    #[test]
    fn open_floor_and_walls_do_not_close_in_on_a_robot_that_drives() {
        for closing in [driven(|_| f32::INFINITY), driven(|step| 4.0 - 0.1 * step)] {
            assert!(closing.closing_mps.iter().all(|closing| *closing <= 0.0), "{:?}", closing.closing_mps);
        }
    }

    #[test]
    fn what_comes_closes_in_with_its_own_speed_and_is_met_in_time() {
        // It comes at 1 m/s, the robot at 1 m/s: 2 m less a second.
        let closing = driven(|step| 4.0 - 0.2 * step);
        assert!((closing.towards_mps(0.0) - 1.0).abs() < 0.1, "{}", closing.towards_mps(0.0));
        assert!(closing.towards_mps(PI) <= 0.0);
        let geometry = ScanGeometry::new(&Task::default());
        // 2.2 m away by then, 2 m from the footprint.
        let contact_s = closing.time_to_contact_s(&geometry, 1.0);
        assert!((contact_s - 1.0).abs() < 0.1, "{contact_s}");
    }
}
