//! Messages made up for tests and benches.

use crate::messages::LaserScan;
use crate::task::Lidar;

impl LaserScan {
    /// A scan of a lidar's geometry, without time or order; `range_m` gives a beam's range for its direction in
    /// the robot frame, rad.
    pub fn of(lidar: &Lidar, range_m: impl Fn(f32) -> f32) -> Self {
        let mut scan = Self {
            angle_min_rad: lidar.angle_min_rad(),
            angle_increment_rad: lidar.angle_increment_rad(),
            range_min_m: lidar.range_min_m,
            range_max_m: lidar.range_max_m,
            beam_count: lidar.beam_count,
            ..Self::default()
        };
        for beam in 0..scan.ranges_m().len() {
            scan.ranges_m[beam] = range_m(lidar.beam_angle_rad(beam));
        }
        scan
    }
}
