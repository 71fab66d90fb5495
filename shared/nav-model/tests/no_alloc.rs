//! The executor never touches the heap; the counter that says so does count.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod support {
    pub(crate) mod models;
    pub(crate) mod onnx;
}

use nav_model::alloc::{self, CheckedAllocator, Counts};
use nav_model::load::load_network;
use std::hint::black_box;
use std::os::unix::process::ExitStatusExt;
use std::process::Command;
use support::models;

#[global_allocator]
static ALLOCATOR: CheckedAllocator = CheckedAllocator;

#[test]
fn running_a_loaded_network_does_not_touch_the_heap() {
    for (name, bytes, contract) in models::all() {
        let mut loaded = load_network(&bytes, &contract).unwrap();
        let input = vec![0.25; contract.input.elements()];
        let mut output = vec![0.0; contract.output.elements()];
        let network = loaded.network_mut();
        let ((), counts) = alloc::count(|| {
            for _ in 0..10 {
                network.run(black_box(&input), black_box(&mut output));
            }
        });
        assert_eq!(counts, Counts::default(), "{name}");
        // tract, in the same place, is seen to allocate.
        let (result, counts) = alloc::count(|| loaded.oracle().run(&input));
        assert!(result.is_ok() && counts.allocations > 0, "{name}: {counts:?}");
    }
}

#[test]
fn the_counter_counts() {
    assert!(alloc::is_installed());
    let (kept, counts) = alloc::count(|| {
        let mut grown: Vec<u64> = Vec::with_capacity(1);
        grown.extend(black_box([1, 2, 3]));
        drop(black_box(Box::new(1)));
        grown
    });
    assert_eq!(counts, Counts { allocations: 3, frees: 1 }, "a vector, its growth, and a box");
    let (_, nothing) = alloc::count(|| black_box(kept.iter().sum::<u64>()));
    assert_eq!(nothing, Counts::default());
    let (thread, counts) = alloc::count(|| std::thread::spawn(|| drop(black_box(vec![0_u8; 1000]))).join());
    thread.unwrap();
    assert!(counts.allocations < 20, "other threads are not counted: {counts:?}");
}

#[test]
fn permitted_allocations_pass_in_a_forbidden_section() {
    let forbidden = alloc::forbid();
    let sum = black_box([1, 2, 3]).iter().sum::<i32>();
    let boxed = alloc::permit(|| Box::new(sum));
    drop(forbidden);
    assert_eq!(*boxed, 6);
}

#[test]
fn an_allocation_in_a_forbidden_section_aborts_with_a_backtrace() {
    let child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "allocates_where_it_must_not", "--ignored", "--nocapture"])
        .output()
        .unwrap();
    let report = String::from_utf8_lossy(&child.stderr);
    assert_eq!(child.status.signal(), Some(libc::SIGABRT), "{report}");
    assert!(
        report.contains("allocation of 4000 bytes in a section that must not touch the heap"),
        "{report}"
    );
    assert!(report.contains("the_culprit"), "the backtrace names the culprit: {report}");
}

#[test]
#[ignore = "aborts the process; run by the test above in a child"]
fn allocates_where_it_must_not() {
    let _forbidden = alloc::forbid();
    the_culprit();
}

#[inline(never)]
fn the_culprit() {
    drop(black_box(vec![1_u8; 4000]));
}
