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
    /// What was granted, in plain words.
    pub words: Vec<String>,
    /// What was not, and what to do.
    pub refused: Vec<String>,
    /// Whether the thread has real-time priority.
    pub has_priority: bool,
}

impl RealTime {
    /// Takes the measures for the calling thread.
    pub fn enter(&self) -> Granted {
        let mut granted = Granted::default();
        if let Some(core) = self.core {
            granted.add(pin(core), format!("the loop runs on core {core} only"), |error| {
                format!("the loop is not bound to core {core} ({error}); it may move between cores")
            });
        }
        if let Some(priority) = self.priority {
            granted.add(lock_memory(), "memory is locked".to_owned(), |error| {
                format!(
                    "memory is not locked ({error}): a page fault may delay a tick; raise LimitMEMLOCK (ulimit -l)"
                )
            });
            let taken = take_fifo(priority);
            granted.has_priority = taken.is_ok();
            granted.add(taken, format!("the loop has real-time priority {priority} (SCHED_FIFO)"), |error| {
                format!(
                    "the loop has ordinary priority ({error}): other programs may delay a tick; raise LimitRTPRIO (ulimit -r)"
                )
            });
        }
        granted
    }
}

impl Granted {
    fn add(
        &mut self,
        outcome: std::io::Result<()>,
        word: String,
        refusal: impl FnOnce(std::io::Error) -> String,
    ) {
        match outcome {
            Ok(()) => self.words.push(word),
            Err(error) => self.refused.push(refusal(error)),
        }
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

/// How the calling thread is scheduled, for people.
pub fn scheduling() -> String {
    let mut parameter = libc::sched_param { sched_priority: 0 };
    // SAFETY: a structure to write to, for the calling thread.
    let (policy, known) =
        unsafe { (libc::sched_getscheduler(0), libc::sched_getparam(0, &raw mut parameter) == 0) };
    let priority = if known { parameter.sched_priority } else { 0 };
    let class = match policy {
        libc::SCHED_FIFO => format!("SCHED_FIFO, priority {priority}"),
        libc::SCHED_RR => format!("SCHED_RR, priority {priority}"),
        _ => "ordinary scheduling".to_owned(),
    };
    match allowed_cores() {
        Ok(cores) => format!("the loop may run on cores {cores:?}, {class}"),
        Err(error) => format!("the loop may run on cores that are not known ({error}), {class}"),
    }
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
            let granted = RealTime { priority: None, core: Some(100_000) }.enter();
            assert!(!granted.has_priority && granted.words.is_empty());
            assert!(granted.refused[0].contains("is not bound"), "{granted:?}");
        })
        .join()
        .expect("no panic");
    }
}
