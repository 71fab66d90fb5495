//! Who moves around the robot: people followed from scan to scan, in the `odom` frame.
//!
//! | step | what happens | file |
//! |---|---|---|
//! | 1 | things of a person's size are found in the scan | `detect.rs`, `fit.rs` |
//! | 2 | everybody walks on as before until the scan's stamp | `filter.rs` |
//! | 3 | things and tracks are paired, the surest first | here |
//! | 4 | what stands where it was free a moment ago has moved; everything else counts as standing | `memory.rs`, `track.rs` |
//! | 5 | who is hidden is kept for a while, and what is left over may be somebody new | here |
//!
//! Time comes from the scans' stamps, so that scans may be missed. The work of an update is bounded.

mod detect;
mod filter;
mod fit;
mod memory;
mod track;

pub use self::track::{STANDING_MPS, Track};

use crate::geometry::{Point, Pose};
use crate::messages::MAX_BEAMS;
use crate::scan::beams::Beams;
use crate::task::Task;
use detect::{DETECTIONS_MAX, Detection, PERSON_RADIUS_M, detect, point_of};
use heapless::Vec;
use memory::{Chord, MARGIN_M, Memory, Seen};
use nalgebra::Matrix2;

/// The most that are followed at a time.
pub const TRACKS_MAX: usize = 32;
/// A thing is taken for a track's when it lies within this squared Mahalanobis distance...
const GATE2: f32 = 12.0;
/// ...and as near as this, m.
const GATE_M: f32 = 0.6;
/// Whoever turns or stops is off by so much from where they were expected, m...
const TURNING_SD_M: f32 = 0.07;
/// ...and from this squared Mahalanobis distance on they have.
const SURPRISE2: f32 = 16.0;
/// Hits that make a track of what was seen once.
const HITS_TO_CONFIRM: u32 = 2;
/// Who is not seen where nothing hides them is forgotten after this time, s...
const LOST_S: f32 = 0.4;
/// ...who is hidden after this, s...
const HIDDEN_S: f32 = 1.5;
/// ...and what was seen but once after this, s.
const LOST_YOUNG_S: f32 = 0.25;
/// The middle of a person of whom one leg is seen may lie so far beside it, m.
const LEG_SD_M: f32 = 0.2;
/// Two tracks so close are one, m.
const SAME_M: f32 = 0.25;
/// After a longer time without scans nobody is where they were, ns.
const GAP_MAX_NS: u64 = 2_000_000_000;
/// So many older scans that show the opposite are all that one scan counts for.
const TIMES_ENOUGH: usize = 2;
/// What is hit so close around somebody is theirs, m.
const OWNED_M: f32 = 0.1;
/// No owner.
const NOBODY: u8 = u8::MAX;

/// A thing seen in this scan, in the `odom` frame.
struct Sighting {
    center: Point,
    cov: Matrix2<f32>,
    radius_m: f32,
    chord: Chord,
    stands_out: bool,
    is_taken: bool,
}

/// Follows people.
#[derive(Clone, Debug)]
pub struct Tracker {
    tracks: Vec<Track, TRACKS_MAX>,
    /// Seen once.
    young: Vec<Track, TRACKS_MAX>,
    memory: Memory,
    found: Vec<Detection, DETECTIONS_MAX>,
    owners: [u8; MAX_BEAMS],
    last: Option<(u64, Pose)>,
    next_id: u32,
    fastest_mps: f32,
}

impl Tracker {
    /// Nobody seen yet, on the robot of a task.
    pub fn new(task: &Task) -> Self {
        Self {
            tracks: Vec::new(),
            young: Vec::new(),
            memory: Memory::new(),
            found: Vec::new(),
            owners: [NOBODY; MAX_BEAMS],
            last: None,
            next_id: 0,
            fastest_mps: task.robot.linear_max_mps,
        }
    }

    /// Forgets everybody: the `odom` frame has begun anew, or the robot was set down elsewhere.
    pub fn forget(&mut self) {
        self.tracks.clear();
        self.young.clear();
        self.memory.forget();
        self.owners.fill(NOBODY);
        self.last = None;
        self.next_id = 0;
    }

    /// Everybody who is followed, moving or standing.
    pub fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// Which of [`Self::tracks`] a beam of the newest scan hit.
    pub fn owner(&self, beam: usize) -> Option<usize> {
        self.owners.get(beam).filter(|owner| **owner != NOBODY).map(|owner| usize::from(*owner))
    }

    /// Takes in a scan that was measured with the lidar at `pose` (`odom_from_lidar`), whose frame is the robot frame here.
    /// The same stamp again changes nothing.
    pub fn update(&mut self, beams: &Beams, pose: Pose, stamp_ns: u64) {
        if !(pose.x_m.is_finite() && pose.y_m.is_finite() && pose.yaw_rad.is_finite()) {
            return;
        }
        let mut dt_s = 0.0;
        if let Some((last_ns, last_pose)) = self.last {
            if stamp_ns == last_ns {
                return;
            }
            let gap_ns = stamp_ns.saturating_sub(last_ns);
            dt_s = gap_ns as f32 / 1e9;
            let jumped_m = (pose.position() - last_pose.position()).norm();
            let is_jump = jumped_m > 0.5 + 2.0 * self.fastest_mps * dt_s;
            if stamp_ns < last_ns || gap_ns > GAP_MAX_NS || is_jump {
                self.forget();
            }
        }
        self.last = Some((stamp_ns, pose));
        self.memory.take(beams, pose, stamp_ns);
        detect(beams, &mut self.found);
        let mut sightings: Vec<Sighting, DETECTIONS_MAX> =
            self.found.iter().map(|detection| sighted(detection, self.memory.now())).collect();
        for track in self.tracks.iter_mut().chain(&mut self.young) {
            track.predict(dt_s);
        }
        pair(&mut self.tracks, &mut sightings, &self.memory, stamp_ns, dt_s);
        pair(&mut self.young, &mut sightings, &self.memory, stamp_ns, dt_s);
        self.drop_lost();
        self.confirm();
        self.begin(&sightings, stamp_ns);
        for track in &mut self.tracks {
            track.publish();
        }
        self.own(beams);
    }

    /// Who was not seen for too long is dropped, and the younger of two that are one.
    fn drop_lost(&mut self) {
        let memory = &self.memory;
        self.young.retain(|track| track.unseen_s < LOST_YOUNG_S);
        self.tracks.retain(|track| {
            let is_seen = track.unseen_s <= 0.0;
            is_seen || track.unseen_s < if is_hidden(track, memory) { HIDDEN_S } else { LOST_S }
        });
        let mut index = 1;
        while index < self.tracks.len() {
            let here = self.tracks[index].filter.position;
            let twin = (0..index)
                .find(|&older| (self.tracks[older].filter.position - here).norm_squared() < SAME_M * SAME_M);
            match twin {
                Some(older) => {
                    let is_better = self.tracks[index].unseen_s < self.tracks[older].unseen_s;
                    let _ = self.tracks.remove(if is_better { older } else { index });
                }
                None => index += 1,
            }
        }
    }

    /// Who was seen often enough is followed. When all places are taken, the farthest that has never moved goes.
    fn confirm(&mut self) {
        let mut index = 0;
        while index < self.young.len() {
            if self.young[index].hits < HITS_TO_CONFIRM {
                index += 1;
                continue;
            }
            let track = self.young.remove(index);
            if self.tracks.is_full() {
                let here = self.memory.now().position();
                let distance_m = |track: &Track| (track.filter.position - here).norm();
                let standing = self.tracks.iter().enumerate().filter(|(_, track)| !track.has_moved());
                let farthest = standing.max_by(|a, b| distance_m(a.1).total_cmp(&distance_m(b.1)));
                match farthest {
                    Some((other, farther)) if distance_m(farther) > distance_m(&track) => {
                        let _ = self.tracks.remove(other);
                    }
                    _ => continue,
                }
            }
            let _ = self.tracks.push(track);
        }
    }

    /// What is left over may be somebody new.
    fn begin(&mut self, sightings: &[Sighting], stamp_ns: u64) {
        for sighting in sightings.iter().filter(|sighting| !sighting.is_taken && sighting.stands_out) {
            if self.young.is_full() {
                return;
            }
            self.next_id = self.next_id.wrapping_add(1);
            let mut track = Track::new(self.next_id, sighting.center, sighting.cov, sighting.radius_m);
            track.leave_trail(sighting.chord, stamp_ns);
            let _ = self.young.push(track);
        }
    }

    /// Works out which beams hit somebody.
    fn own(&mut self, beams: &Beams) {
        let all = beams.as_slice();
        self.owners.fill(NOBODY);
        for (index, track) in self.tracks.iter().enumerate().filter(|(_, track)| track.unseen_s <= 0.0) {
            let center = self.memory.now().local_from_odom(track.position);
            let reach_m = track.radius_m.max(PERSON_RADIUS_M) + OWNED_M;
            let (first, count) = self.memory.now().window(track.position, reach_m);
            for beam in (first..first + count).map(|beam| beam % all.len().max(1)) {
                if all[beam].is_hit() && (point_of(&all[beam]) - center).norm_squared() < reach_m * reach_m {
                    self.owners[beam] = index as u8;
                }
            }
        }
    }
}

fn sighted(detection: &Detection, now: &Seen) -> Sighting {
    let turn = now.turn();
    let place = |local: Point| now.odom_from_local(local);
    let legs = if detection.is_leg { LEG_SD_M * LEG_SD_M } else { 0.0 };
    Sighting {
        center: place(detection.center),
        cov: turn * detection.cov * turn.transpose() + Matrix2::from_diagonal_element(legs),
        radius_m: detection.radius_m,
        chord: Chord {
            right: place(detection.ends[0]),
            left: place(detection.ends[1]),
            gap_m: detection.gap_m,
        },
        stands_out: detection.stands_out,
        is_taken: false,
    }
}

/// Pairs tracks with what was seen, the likeliest first, and updates them.
fn pair(tracks: &mut [Track], sightings: &mut [Sighting], memory: &Memory, stamp_ns: u64, dt_s: f32) {
    let mut pairs: Vec<(f32, u8, u8), 256> = Vec::new();
    let turning = Matrix2::from_diagonal_element(TURNING_SD_M * TURNING_SD_M);
    for (index, track) in tracks.iter().enumerate() {
        for (other, sighting) in sightings.iter().enumerate().filter(|(_, sighting)| !sighting.is_taken) {
            let apart = sighting.center - track.filter.position;
            if apart.norm_squared() > GATE_M * GATE_M {
                continue;
            }
            let (distance2, spread) = track.filter.distance2(sighting.center, &(sighting.cov + turning));
            if distance2 < GATE2 {
                // The likelihood of the pair, as twice its negative logarithm.
                let _ = pairs.push((distance2 + libm::logf(spread), index as u8, other as u8));
            }
        }
    }
    pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    for &(_, index, other) in &pairs {
        let (track, sighting) = (&mut tracks[usize::from(index)], &mut sightings[usize::from(other)]);
        if track.unseen_s <= 0.0 || sighting.is_taken {
            continue;
        }
        sighting.is_taken = true;
        track.unseen_s = 0.0;
        track.hits = track.hits.saturating_add(1);
        if track.filter.distance2(sighting.center, &sighting.cov).0 > SURPRISE2 {
            track.filter.surprise(dt_s);
        }
        track.filter.update(sighting.center, &sighting.cov);
        track.radius_m += 0.2 * (sighting.radius_m - track.radius_m);
        if track.is_due_for_evidence() {
            track.weigh(evidence(track, sighting, memory));
        }
        track.leave_trail(sighting.chord, stamp_ns);
    }
}

/// What speaks for having moved: to stand where it was free before, or to have left where it stood.
fn evidence(track: &Track, sighting: &Sighting, memory: &Memory) -> f32 {
    let mut count = memory.times_free(&sighting.chord, TIMES_ENOUGH);
    if count < TIMES_ENOUGH {
        count += track.trail().iter().filter(|chord| memory.now().passed_through(chord)).count();
    }
    // Once is chance.
    (count as f32).clamp(0.0, 2.0) * 0.5
}

/// Whether something nearer hides where a track should be.
fn is_hidden(track: &Track, memory: &Memory) -> bool {
    memory.now().beyond_m(track.filter.position).is_some_and(|beyond_m| beyond_m < -MARGIN_M)
}

#[cfg(test)]
mod tests;
