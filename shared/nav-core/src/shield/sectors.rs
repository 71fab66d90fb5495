//! A scan by sectors of the lidar's own, and what the beams beside one hit.

use crate::footprint::Footprint;
use crate::geometry::{Point, Pose};
use crate::messages::MAX_BEAMS;
use crate::scan::beams::{Beam, Beams};
use core::f32::consts::{PI, TAU};

/// The most sectors around a robot, one point each: a rectangle has so many, because corners fit between points that a disc
/// does not fit between.
pub(super) const SECTORS_MAX: usize = 144;
/// A disc has so many.
const SECTORS_OF_A_DISC: usize = 72;

/// Which sector each beam lies in, worked out once for a lidar.
#[derive(Clone, Debug)]
pub(super) struct Sectors {
    count: usize,
    /// Beams, and the direction of the first and of the last one.
    layout: (usize, [u32; 4]),
    pub(super) of_beam: [u8; MAX_BEAMS],
}

impl Sectors {
    /// Around a robot, of no lidar.
    pub(super) fn new(footprint: &Footprint) -> Self {
        let count = if footprint.corners().is_some() { SECTORS_MAX } else { SECTORS_OF_A_DISC };
        Self { count, layout: (0, [0; 4]), of_beam: [0; MAX_BEAMS] }
    }

    /// Works it out, unless the last scan had the same beams.
    pub(super) fn lay_out(&mut self, beams: &Beams) {
        let beams = beams.as_slice();
        let (Some(first), Some(last)) = (beams.first(), beams.last()) else { return };
        let layout = (beams.len(), [first.cos, first.sin, last.cos, last.sin].map(f32::to_bits));
        if layout == self.layout {
            return;
        }
        self.layout = layout;
        for (sector, beam) in self.of_beam.iter_mut().zip(beams) {
            let turn = (libm::atan2f(beam.sin, beam.cos) + PI) / TAU;
            // A hair more, so that beams on borders fall on one side whatever the rounding.
            *sector = ((turn * self.count as f32 + 1e-3) as usize % self.count) as u8;
        }
    }
}

/// What the beams beside one hit.
#[derive(Clone, Copy, Debug)]
pub(super) enum Beside {
    /// Both the same thing.
    Wide,
    /// One of them the same thing, here in the `odom` frame, m.
    End(Point),
    /// Neither.
    Alone,
}

/// The nearest thing in a sector.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    /// Where, in the `odom` frame, m.
    pub(super) point: Point,
    /// When it was seen.
    pub(super) stamp_ns: u64,
    /// What was hit beside it.
    pub(super) beside: Beside,
}

/// A scan, and where it was taken.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) beams: &'a Beams,
    pub(super) sectors: &'a Sectors,
    /// Of the lidar, `odom_from_lidar`.
    pub(super) pose: Pose,
    pub(super) stamp_ns: u64,
    /// The robot's, and where the lidar sits in it: what is too near to be measured touches it.
    pub(super) footprint: &'a Footprint,
    pub(super) mount: &'a Pose,
}

/// The beams beside one that hit the same thing as it.
pub(super) fn same_beside(beams: &[Beam], index: usize, gap_m: f32) -> [Option<&Beam>; 2] {
    let count = beams.len();
    [index + count - 1, index + 1].map(|beside| {
        let beam = &beams[beside % count];
        ((beam.range_m - beams[index].range_m).abs() <= gap_m).then_some(beam)
    })
}
