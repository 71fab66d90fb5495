//! The clock of every stamp on the wire: `CLOCK_MONOTONIC`, the same for all processes of a machine.

/// Nanoseconds since an arbitrary start, never running backwards.
pub fn monotonic_ns() -> u64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is valid for the write; CLOCK_MONOTONIC exists on every supported system, so it cannot fail.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut time) };
    let seconds = u64::try_from(time.tv_sec).unwrap_or_default();
    let nanoseconds = u64::try_from(time.tv_nsec).unwrap_or_default();
    seconds * 1_000_000_000 + nanoseconds
}

/// A duration as the system's own type, from nanoseconds.
pub(crate) fn timespec(duration_ns: u64) -> libc::timespec {
    libc::timespec {
        tv_sec: libc::time_t::try_from(duration_ns / 1_000_000_000).unwrap_or(libc::time_t::MAX),
        tv_nsec: libc::c_long::try_from(duration_ns % 1_000_000_000).unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_goes_forward_in_nanoseconds() {
        let before_ns = monotonic_ns();
        std::thread::sleep(std::time::Duration::from_millis(20));
        let passed_ns = monotonic_ns() - before_ns;
        assert!(passed_ns >= 20_000_000, "{passed_ns}");
    }
}
