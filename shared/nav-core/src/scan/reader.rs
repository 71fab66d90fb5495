//! From a scan of any lidar to the beams that the policy was trained with.
//!
//! Without the safety gate each trained beam takes the nearest thing that was measured within its own width; in a coarser
//! scan a measured beam stands for its own step. That makes gaps narrower than the policy is used to. Behind the gate, which
//! looks at every beam itself, a trained beam takes what was measured in its own direction, as the trained lidar would, and
//! besides only what is so small that the trained lidar would have missed it. What nobody measured is unknown. The trained
//! lidar's own scans pass unchanged.
//!
//! What a range means is said in `ranges.rs`.

use super::Misfit;
use super::beams::{ANGLE_MIN_RAD, INCREMENT_RAD};
use super::ranges::meaning_m;
use super::recall::Recall;
use crate::geometry::{Pose, wrap_angle};
use crate::messages::{LaserScan, MAX_BEAMS};
use crate::task::{ShieldMode, Task};

/// Share of beams that must have measured before a scan may be driven on.
const MEASURED_SHARE_MIN: f32 = 0.75;
/// So much of the trained field of view may be looked into by no beam, rad: 10 degrees, counted as unknown.
const UNSEEN_MAX_RAD: f32 = 0.175;
/// What is too near to be measured may begin so far outside the robot, m of the reference robot ([`crate::scale`]).
const MINIMUM_BEYOND_M: f32 = 0.3;
/// What is nearer than all around it by more than this is small, m of the reference robot.
const SMALL_M: f32 = 0.25;
/// Directions that differ by less than this share of a trained beam's width are as near to it.
const SAME_SHARE: f32 = 0.02;
/// So many good scans in a row end a fault of the scan.
const SETTLED_SCANS: u32 = 5;
/// Where something stood within this share of the range, scans that hit nothing at all...
const VANISHED_SHARE: f32 = 0.5;
/// ...are doubted after this time, ns.
const VANISHED_AFTER_NS: u64 = 1_000_000_000;

/// Reads scans of any geometry as the trained lidar's.
#[derive(Clone, Debug)]
pub struct ScanReader {
    task: Task,
    no_return_m: f32,
    /// Header of the scan that the table below was made for: first direction, increment, beams.
    layout: (u32, u32, u32),
    /// First trained beam that a measured beam stands for...
    first: [u16; MAX_BEAMS],
    /// ...and how many, counter-clockwise.
    count: [u16; MAX_BEAMS],
    /// The measured beam nearest to each trained one's direction; twice the same, or one to either side as near.
    nearest: [[u16; 2]; MAX_BEAMS],
    /// From the lidar to the robot's outline along each measured beam, m.
    edge_m: [f32; MAX_BEAMS],
    /// Trained beams that no measured beam looks into.
    unseen: usize,
    beams_m: [f32; MAX_BEAMS],
    /// What was measured in each trained beam's direction, m.
    straight_m: [f32; MAX_BEAMS],
    recall: Recall,
    last_seq: u64,
    /// Good scans in a row since the last bad one.
    good_scans: u32,
    /// Nearest hit of the last scan with any, m, and when the first scan without came.
    vanishing: (f32, Option<u64>),
}

impl ScanReader {
    /// For the lidar of `task`.
    pub fn new(task: &Task) -> Self {
        Self {
            task: *task,
            no_return_m: f32::INFINITY,
            layout: (0, 0, 0),
            first: [0; MAX_BEAMS],
            count: [0; MAX_BEAMS],
            nearest: [[0; 2]; MAX_BEAMS],
            edge_m: [0.0; MAX_BEAMS],
            unseen: 0,
            beams_m: [f32::NAN; MAX_BEAMS],
            straight_m: [f32::NAN; MAX_BEAMS],
            recall: Recall::new(&task.lidar, task.control_period_ns()),
            last_seq: 0,
            good_scans: SETTLED_SCANS,
            vanishing: (f32::INFINITY, None),
        }
    }

    /// A finite range from which on the driver means that nothing was hit, m. Infinite at first.
    pub fn set_no_return_m(&mut self, no_return_m: f32) {
        self.no_return_m = no_return_m;
    }

    /// Whether the policy is driven behind the safety gate. At first as the task says.
    pub fn set_shield(&mut self, mode: ShieldMode) {
        self.task.shield = mode;
    }

    /// Why this scan may not be driven on, if it may not; asked once a tick, before [`Self::read`].
    ///
    /// # Errors
    /// The first [`Misfit`].
    pub fn inspect(&mut self, scan: &LaserScan) -> Result<(), Misfit> {
        let is_new = scan.header.seq != self.last_seq;
        self.last_seq = scan.header.seq;
        let fine = self.fits(scan).and_then(|()| self.measures(scan));
        if is_new {
            self.good_scans = if fine.is_ok() { self.good_scans.saturating_add(1) } else { 0 };
        }
        fine?;
        if self.good_scans < SETTLED_SCANS {
            return Err(Misfit::Settling { needed: SETTLED_SCANS, good: self.good_scans });
        }
        Ok(())
    }

    /// Whether the scan's geometry can stand in for the trained one.
    fn fits(&mut self, scan: &LaserScan) -> Result<(), Misfit> {
        let LaserScan { angle_min_rad, angle_increment_rad, range_min_m, range_max_m, beam_count, .. } =
            *scan;
        let lidar = self.task.lidar;
        let is_number =
            angle_min_rad.abs() < ANGLE_MIN_RAD && range_min_m.is_finite() && !range_max_m.is_nan();
        if !is_number || !INCREMENT_RAD.contains(&angle_increment_rad.abs()) {
            return Err(Misfit::Header { angle_min_rad, angle_increment_rad, range_min_m, range_max_m });
        }
        if beam_count as usize > MAX_BEAMS {
            return Err(Misfit::TooManyBeams { most: MAX_BEAMS as u32, found: beam_count });
        }
        if 2 * beam_count < lidar.beam_count {
            return Err(Misfit::FewBeams { trained: lidar.beam_count, found: beam_count });
        }
        if range_max_m < 0.5 * lidar.range_max_m {
            return Err(Misfit::ShortRange { trained_m: lidar.range_max_m, found_m: range_max_m });
        }
        self.lay_out(scan);
        let edges_m = &self.edge_m[..scan.ranges_m().len()];
        let inside_m = edges_m.iter().fold(f32::INFINITY, |least: f32, &edge_m| least.min(edge_m));
        let most_m = lidar.range_min_m.max(inside_m + self.task.scale().m(MINIMUM_BEYOND_M));
        if range_min_m > most_m {
            return Err(Misfit::FarMinimum { most_m, found_m: range_min_m });
        }
        let unseen_rad = self.unseen as f32 * lidar.angle_increment_rad();
        if unseen_rad > UNSEEN_MAX_RAD {
            let trained_rad = lidar.field_of_view_rad;
            return Err(Misfit::NarrowView { trained_rad, found_rad: (trained_rad - unseen_rad).max(0.0) });
        }
        Ok(())
    }

    /// Whether enough of its beams measured, and what they measured can be.
    fn measures(&mut self, scan: &LaserScan) -> Result<(), Misfit> {
        let (mut measured, mut nearest_m) = (0_u32, f32::INFINITY);
        for beam in 0..scan.ranges_m().len() {
            let means_m = self.meaning_m(scan, beam);
            measured += u32::from(!means_m.is_nan());
            nearest_m = nearest_m.min(means_m);
        }
        let beams = scan.beam_count;
        if (measured as f32) < MEASURED_SHARE_MIN * beams as f32 {
            return Err(Misfit::Blind { measured, beams });
        }
        if nearest_m.is_finite() {
            self.vanishing = (nearest_m, None);
            return Ok(());
        }
        let (stood_m, since) = &mut self.vanishing;
        let for_ns = scan.header.stamp_ns.saturating_sub(*since.get_or_insert(scan.header.stamp_ns));
        if *stood_m < VANISHED_SHARE * self.task.lidar.range_max_m && for_ns > VANISHED_AFTER_NS {
            return Err(Misfit::Vanished { for_s: for_ns as f32 / 1e9, nearest_m: *stood_m });
        }
        Ok(())
    }

    /// What a beam's range means to the policy: where something is, m; `INFINITY` for nothing within the trained range, NaN for
    /// nothing known.
    fn meaning_m(&self, scan: &LaserScan, beam: usize) -> f32 {
        let means_m = meaning_m(scan, scan.ranges_m[beam], self.no_return_m);
        if means_m <= 0.0 {
            return scan.range_min_m.min(self.edge_m[beam]);
        }
        if means_m >= self.task.lidar.range_max_m { f32::INFINITY } else { means_m }
    }

    /// Works out which trained beams each measured beam stands for, unless the last scan had the same layout.
    fn lay_out(&mut self, scan: &LaserScan) {
        let layout = (scan.angle_min_rad.to_bits(), scan.angle_increment_rad.to_bits(), scan.beam_count);
        if layout == self.layout {
            return;
        }
        self.layout = layout;
        let lidar = &self.task.lidar;
        let (trained, width_rad) =
            ((lidar.beam_count as usize).min(MAX_BEAMS) as i32, lidar.angle_increment_rad());
        // A thousandth more, so that what lies on a border belongs to both sides whatever the rounding.
        let half = 0.501 * (scan.angle_increment_rad.abs() / width_rad).max(1.0);
        let mut away = [f32::INFINITY; MAX_BEAMS];
        for beam in 0..scan.ranges_m().len() {
            let angle_rad = wrap_angle(scan.angle_min_rad + beam as f32 * scan.angle_increment_rad);
            let (sin, cos) = libm::sincosf(angle_rad);
            self.edge_m[beam] = self.task.robot.footprint.edge_m(&lidar.mount, cos, sin);
            let place = (angle_rad - lidar.angle_min_rad()) / width_rad;
            let (mut low, mut high) = (libm::ceilf(place - half) as i32, libm::floorf(place + half) as i32);
            if lidar.is_full_circle() {
                high = high.min(low + trained - 1);
            } else {
                (low, high) = (low.max(0), high.min(trained - 1));
            }
            let count = (high - low + 1).max(0);
            self.first[beam] = low.rem_euclid(trained) as u16;
            self.count[beam] = count as u16;
            for step in 0..count {
                let at = (low + step).rem_euclid(trained) as usize;
                let beam_away = (place - (low + step) as f32).abs();
                if beam_away < away[at] - SAME_SHARE {
                    (away[at], self.nearest[at]) = (beam_away, [beam as u16; 2]);
                } else if beam_away < away[at] + SAME_SHARE {
                    self.nearest[at][1] = beam as u16;
                }
            }
        }
        self.unseen = away[..trained as usize].iter().filter(|away| away.is_infinite()).count();
    }

    /// The trained beams of a scan that was [inspected](Self::inspect), m, as `ranges.rs` says; what failed is taken
    /// from what was seen there a moment ago. `pose` is where the robot was, `odom_from_robot`. They are in the lidar's own
    /// frame: where it sits on the robot [`ScanView`](super::ScanView) knows.
    pub fn read(&mut self, scan: &LaserScan, pose: Pose) -> &[f32] {
        self.lay_out(scan);
        let trained = (self.task.lidar.beam_count as usize).min(MAX_BEAMS);
        self.beams_m[..trained].fill(f32::NAN);
        for beam in 0..scan.ranges_m().len() {
            let means_m = self.meaning_m(scan, beam);
            let mut at = usize::from(self.first[beam]);
            for _ in 0..self.count[beam] {
                // The minimum of a number and NaN is the number.
                self.beams_m[at] = self.beams_m[at].min(means_m);
                at = if at + 1 == trained { 0 } else { at + 1 };
            }
        }
        if self.task.shield == ShieldMode::On {
            self.straighten(scan, trained);
        }
        let lidar_pose = self.task.lidar.pose(pose);
        self.recall.complete(&mut self.beams_m[..trained], scan.header.stamp_ns, lidar_pose);
        &self.beams_m[..trained]
    }

    /// Leaves what was measured in each beam's own direction, and things that are small.
    fn straighten(&mut self, scan: &LaserScan, trained: usize) {
        for at in 0..trained {
            let [one, other] = self.nearest[at].map(|beam| self.meaning_m(scan, usize::from(beam)));
            // Where two are as near, what lies between them is open, and what failed does not count.
            let straight_m = one.max(other);
            self.straight_m[at] = if straight_m.is_nan() { self.beams_m[at] } else { straight_m };
        }
        let small_m = self.task.scale().m(SMALL_M);
        for at in 0..trained {
            let beside = [(at + trained - 1) % trained, at, (at + 1) % trained];
            let around_m = beside.into_iter().fold(f32::INFINITY, |m: f32, at| m.min(self.straight_m[at]));
            let is_small = self.beams_m[at] < around_m - small_m;
            if !is_small {
                self.beams_m[at] = self.straight_m[at];
            }
        }
    }

    /// Forgets what was seen a moment ago: a new life begins.
    pub fn forget(&mut self) {
        self.recall.forget();
    }

    /// Forgets all that was ever seen: the robot was set down elsewhere, where there may be no walls.
    pub fn forget_walls(&mut self) {
        self.recall.forget();
        self.vanishing = (f32::INFINITY, None);
    }
}
