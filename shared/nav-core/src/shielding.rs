//! The safety gate as every driver uses it: what it sees, what it is told of the base, what it may try. Said once, so that
//! policy and rival stand behind the same gate.

use crate::guard::Guard;
use crate::messages::{LaserScan, Odometry, fault};
use crate::navigator::Navigator;
use crate::shield::{Intervention, Open, Shield};
use crate::task::{ShieldMode, Task};
use crate::twist::Twist;

/// The safety gate of a task, or none where it is switched off.
#[derive(Clone, Debug)]
pub struct Shielding {
    task: Task,
    no_return_m: f32,
    shield: Option<Shield>,
}

impl Shielding {
    /// As the task says.
    pub fn new(task: &Task) -> Self {
        let mut shielding = Self { task: *task, no_return_m: f32::INFINITY, shield: None };
        shielding.switch(task.shield);
        shielding
    }

    /// Switches it on or off, whatever the task says.
    pub fn switch(&mut self, mode: ShieldMode) {
        self.shield = (mode == ShieldMode::On).then(|| Shield::new(&self.task));
        self.set_no_return_m(self.no_return_m);
    }

    /// A finite range from which on the lidar's driver means that nothing was hit, m.
    pub fn set_no_return_m(&mut self, no_return_m: f32) {
        self.no_return_m = no_return_m;
        if let Some(shield) = &mut self.shield {
            shield.set_no_return_m(no_return_m);
        }
    }

    /// Takes in a new scan, after the navigator did.
    pub fn observe(&mut self, scan: &LaserScan, odom: &Odometry, navigator: &Navigator) {
        if let Some(shield) = &mut self.shield {
            if navigator.was_set_down() {
                shield.forget();
            }
            shield.see(scan, odom.pose);
        }
    }

    /// What may leave of a wish, why if that is another, and [`fault`] bits. A wish that is not finite is left to the guard.
    pub fn filter(
        &self,
        wish: Twist,
        odom: &Odometry,
        guard: &Guard,
        navigator: &Navigator,
    ) -> (Twist, Option<Intervention>, u32) {
        let Some(shield) = &self.shield else { return (wish, None, 0) };
        if !wish.is_finite() {
            return (wish, None, 0);
        }
        // After a pause nobody obeys what was commanded before it.
        let sent = guard.sent().with_newest(guard.ramp_from());
        let scan = navigator.scan();
        let open = Open { ahead: !scan.is_closed_ahead(), behind: !scan.is_closed_behind() };
        let wish = self.task.robot.limited(wish);
        let (command, intervention) = shield.filter(wish, odom.twist(), &sent, open);
        (command, intervention, if command == wish { 0 } else { fault::SHIELDED })
    }

    /// The odom frame began anew.
    pub fn forget(&mut self) {
        if let Some(shield) = &mut self.shield {
            shield.forget();
        }
    }

    /// The gate, unless it is switched off.
    pub fn shield(&self) -> Option<&Shield> {
        self.shield.as_ref()
    }

    /// See [`Self::shield`].
    pub fn shield_mut(&mut self) -> Option<&mut Shield> {
        self.shield.as_mut()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{Goal, Header};

    /// What becomes of full speed ahead in a second, with something measured all around.
    fn ahead(shielding: &mut Shielding, task: &Task, second: u64) -> Twist {
        let (mut navigator, guard) = (Navigator::new(task), Guard::new(task));
        let header = Header { stamp_ns: second * 1_000_000_000, seq: second };
        let scan = LaserScan { header, ..LaserScan::of(&task.lidar, |_| 0.25) };
        let odom = Odometry { header, ..Odometry::default() };
        navigator.observe(&scan, &odom, &Goal::default());
        shielding.observe(&scan, &odom, &navigator);
        shielding.filter(Twist::new(1.0, 0.0), &odom, &guard, &navigator).0
    }

    #[test]
    fn a_gate_that_is_switched_on_later_knows_what_no_return_means() {
        let task = Task { shield: ShieldMode::Off, ..Task::default() };
        let mut shielding = Shielding::new(&task);
        let full = Twist::new(1.0, 0.0);
        assert_eq!(ahead(&mut shielding, &task, 1), full, "no gate");
        shielding.switch(ShieldMode::On);
        assert!(ahead(&mut shielding, &task, 2) != full, "things all around");
        shielding.set_no_return_m(0.25);
        assert_eq!(ahead(&mut shielding, &task, 3), full);
        shielding.switch(ShieldMode::Off);
        shielding.switch(ShieldMode::On);
        assert_eq!(ahead(&mut shielding, &task, 4), full);
    }
}
