//! What makes a thread keep its deadlines: locked memory, real-time priority, a core of its own.
//!
//! None of it is needed to drive, and any of it may be forbidden; what was achieved is said in plain words.

/// Which measures to take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RealTime {
    /// Lock memory and take this `SCHED_FIFO` priority, 1 to 99.
    pub priority: Option<u8>,
    /// Run this thread on this core only.
    pub core: Option<usize>,
}

/// What was granted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Granted {
    /// What was and was not granted, in plain words.
    pub words: Vec<String>,
    /// Whether the thread has real-time priority.
    pub has_priority: bool,
}

impl RealTime {
    /// Takes the measures for the calling thread.
    pub fn enter(&self) -> Granted {
        let mut words = Vec::new();
        let mut has_priority = false;
        if let Some(core) = self.core {
            words.push(match pin(core) {
                Ok(()) => format!("the loop runs on core {core} only"),
                Err(error) => {
                    format!("the loop is not bound to core {core} ({error}); it may move between cores")
                }
            });
        }
        if let Some(priority) = self.priority {
            words.push(match lock_memory() {
                Ok(()) => "memory is locked".to_owned(),
                Err(error) => format!(
                    "memory is not locked ({error}): a page fault may delay a tick; raise LimitMEMLOCK (ulimit -l)"
                ),
            });
            let taken = take_fifo(priority);
            has_priority = taken.is_ok();
            words.push(match taken {
                Ok(()) => format!("the loop has real-time priority {priority} (SCHED_FIFO)"),
                Err(error) => format!(
                    "the loop has ordinary priority ({error}): other programs may delay a tick; raise LimitRTPRIO (ulimit -r)"
                ),
            });
        }
        Granted { words, has_priority }
    }
}

/// Binds the calling thread to one core.
///
/// # Errors
/// The core does not exist or is not allowed.
pub fn pin(core: usize) -> std::io::Result<()> {
    restrict(&[core])
}

/// Restricts the calling thread, and what it starts from now on, to some cores.
///
/// # Errors
/// None of the cores exists or is allowed.
pub fn restrict(cores: &[usize]) -> std::io::Result<()> {
    // SAFETY: a cpu_set_t is plain bits, all zero is empty.
    let mut set: libc::cpu_set_t = unsafe { std::mem::zeroed() };
    for core in cores.iter().filter(|core| **core < libc::CPU_SETSIZE as usize) {
        // SAFETY: the core lies inside the set, as filtered.
        unsafe { libc::CPU_SET(*core, &mut set) };
    }
    // SAFETY: a valid set of the given size, for the calling thread.
    outcome(unsafe { libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set) })
}

/// The cores that the calling thread may use.
///
/// # Errors
/// The operating system refuses.
pub fn allowed_cores() -> std::io::Result<Vec<usize>> {
    // SAFETY: a cpu_set_t is plain bits.
    let mut set: libc::cpu_set_t = unsafe { std::mem::zeroed() };
    // SAFETY: a valid set of the given size, for the calling thread.
    outcome(unsafe { libc::sched_getaffinity(0, size_of::<libc::cpu_set_t>(), &raw mut set) })?;
    // SAFETY: each core lies inside the set.
    Ok((0..libc::CPU_SETSIZE as usize).filter(|core| unsafe { libc::CPU_ISSET(*core, &set) }).collect())
}

fn lock_memory() -> std::io::Result<()> {
    // SAFETY: takes flags only.
    outcome(unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) })
}

fn take_fifo(priority: u8) -> std::io::Result<()> {
    let parameter = libc::sched_param { sched_priority: i32::from(priority) };
    // SAFETY: a valid parameter, for the calling thread.
    outcome(unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameter) })
}

fn outcome(status: libc::c_int) -> std::io::Result<()> {
    if status == 0 { Ok(()) } else { Err(std::io::Error::last_os_error()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_can_be_bound_and_says_so() {
        std::thread::spawn(|| {
            let cores = allowed_cores().expect("readable");
            pin(cores[0]).expect("an allowed core");
            assert_eq!(allowed_cores().expect("readable"), cores[..1]);
            let Granted { words, has_priority } = RealTime { priority: None, core: Some(100_000) }.enter();
            assert!(!has_priority);
            assert!(words[0].contains("is not bound"), "{words:?}");
        })
        .join()
        .expect("no panic");
    }
}
