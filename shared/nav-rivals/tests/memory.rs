//! What a planner says of its memory, against what it takes from the heap.

use nav_core::geometry::Pose;
use nav_core::messages::CmdVel;
use nav_core::task::Task;
use nav_core::tick::{Inputs, Tick, TickStatus};
use nav_env::robot::{Driver, SimulatedRobot};
use nav_env::searched::Searched;
use nav_env::worlds::Place;
use nav_rivals::Rival;
use nav_sim::disturbance::Disturbance;
use nav_sim::families::{Family, Split};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Bytes held now, and at the most since it was set.
static HELD: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

/// The system's allocator, which counts.
struct Counting;

// SAFETY: every request is passed on to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let held = HELD.fetch_add(layout.size(), Relaxed) + layout.size();
        PEAK.fetch_max(held, Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A driver, and the most that a tick of it took from the heap, bytes.
struct Weighed(Box<dyn Driver + Send>, usize);

impl Tick for Weighed {
    fn tick(&mut self, now_ns: u64, inputs: Inputs<'_>) -> (CmdVel, TickStatus) {
        let before = HELD.load(Relaxed);
        PEAK.store(before, Relaxed);
        let answer = self.0.tick(now_ns, inputs);
        self.1 = self.1.max(PEAK.load(Relaxed) - before);
        answer
    }

    fn task(&self) -> &Task {
        self.0.task()
    }
}

impl Driver for Weighed {
    fn begin(&mut self, place: &Place) {
        self.0.begin(place);
    }

    fn localise(&mut self, map_from_odom: Pose) {
        self.0.localise(map_from_odom);
    }

    fn searched(&self) -> Option<Searched> {
        self.0.searched()
    }
}

/// One test: nothing else must allocate meanwhile.
#[test]
fn a_search_takes_what_it_says_and_what_an_allocator_keeps_spare() {
    let task = Task::default();
    let mut robot = SimulatedRobot::new(&task, &Disturbance::none());
    for rival in [Rival::Astar, Rival::Dijkstra] {
        for family in [Family::Clutter, Family::Maze] {
            let place = Place::generated(family, Split::Validation, 3, &task.robot.footprint);
            let mut driver = Weighed(rival.driver(&task), 0);
            let driven = robot.drive(&mut driver, &place, false);
            let searched = driven.searched.expect("it plans");
            assert_eq!(searched.searches, 1);
            // Its tables double when they are full, and the old one is there until the new one is filled.
            let (told, taken) = (searched.bytes as f64, driver.1 as f64);
            assert!(
                told < 1.05 * taken && taken < 4.0 * told,
                "{rival} in {family}: {told} told, {taken} taken"
            );
        }
    }
    let place = Place::generated(Family::Clutter, Split::Validation, 0, &task.robot.footprint);
    let driven = robot.drive(&mut *Rival::Reactive.driver(&task), &place, false);
    assert_eq!(driven.searched, None, "it does not plan");
}
