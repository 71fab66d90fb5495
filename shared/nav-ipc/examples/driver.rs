//! A robot driver in small: a pretend base in an empty room. Put your base where the pose is integrated, and your lidar where
//! the walls are. What travels is described in `docs/topics.md`.
//!
//! ```sh
//! cargo run --release --example driver -p nav-ipc -- [ROBOT [IPC_ROOT]]
//! ```

use nav_core::driver_guard::DriverGuard;
use nav_core::geometry::{Pose, wrap_angle};
use nav_core::messages::{CmdVel, Goal, Header, LaserScan, Odometry};
use nav_core::task::Task;
use nav_ipc::{IpcConfig, IpcError, RobotName, RobotNode, clock};
use std::path::Path;
use std::time::Duration;

/// The walls of the room lie this far from its middle, m.
const ROOM_M: (f32, f32) = (4.0, 3.0);

/// From the robot to the wall in a direction of its own frame, m.
fn wall_m(pose: &Pose, angle_rad: f32) -> f32 {
    let (sine, cosine) = (pose.yaw_rad + angle_rad).sin_cos();
    let to_wall_m = |position_m: f32, direction: f32, half_m: f32| {
        // No component in this direction: infinitely far.
        (half_m - position_m * direction.signum()) / direction.abs()
    };
    to_wall_m(pose.x_m, cosine, ROOM_M.0).min(to_wall_m(pose.y_m, sine, ROOM_M.1))
}

fn main() -> Result<(), IpcError> {
    let mut arguments = std::env::args().skip(1);
    let robot = RobotName::new(&arguments.next().unwrap_or_else(|| "robot".to_owned()))?;
    let root = arguments.next();
    let node = RobotNode::open(&robot, &IpcConfig::from_option(root.as_ref().map(Path::new))?)?;
    let (scan_out, odom_out) = (node.writer::<LaserScan>()?, node.writer::<Odometry>()?);
    let (goal_out, command_in) = (node.writer::<Goal>()?, node.reader::<CmdVel>()?);

    // The limits, the period and the lidar of the shipped model; another one has them in its manifest.
    let task = Task::default();
    let mut guard = DriverGuard::new(&task);
    let mut pose = Pose::new(-2.5, -1.0, 0.0);
    let mut command = CmdVel::default();
    let mut deadline_ns = clock::monotonic_ns();
    for seq in 1.. {
        // An error ends the driver, and with it what moves the base: a real one brakes first.
        let is_new = command_in.read_latest(&mut command)?;
        let now_ns = clock::monotonic_ns();
        if is_new && guard.is_fresh(&command, now_ns) {
            guard.accept(&command, now_ns);
        }
        // Within the limits of the base, and a ramp to zero when commands have stopped coming.
        let velocity = guard.target(now_ns);
        pose = pose.advanced(velocity, task.control_period_s);
        pose.yaw_rad = wrap_angle(pose.yaw_rad);

        let header = Header { stamp_ns: now_ns, seq };
        let (linear_mps, angular_radps) = (velocity.linear_mps, velocity.angular_radps);
        odom_out.write(&Odometry { header, pose, linear_mps, angular_radps, reserved: 0 })?;
        goal_out.write(&Goal { header, x_m: 2.0, y_m: 1.0, radius_m: task.goal_radius_m, id: 1 })?;
        // Last, because it wakes the runtime.
        let scan = LaserScan::of(&task.lidar, |angle_rad| match wall_m(&pose, angle_rad) {
            range_m if range_m <= task.lidar.range_max_m => range_m,
            _ => f32::INFINITY,
        });
        scan_out.write(&LaserScan { header, ..scan })?;

        deadline_ns = (deadline_ns + task.control_period_ns()).max(clock::monotonic_ns());
        std::thread::sleep(Duration::from_nanos(deadline_ns - clock::monotonic_ns().min(deadline_ns)));
    }
    Ok(())
}
