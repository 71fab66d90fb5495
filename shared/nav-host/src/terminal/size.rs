//! How much room there is.

/// Columns and lines of the terminal at stdout; 80 x 24, the oldest of all sizes, where there is none or it does not
/// say.
pub fn size() -> (usize, usize) {
    // SAFETY: a winsize is plain numbers.
    let mut size: libc::winsize = unsafe { std::mem::zeroed() };
    // SAFETY: only asks, into a valid place.
    let status = unsafe { libc::ioctl(libc::STDOUT_FILENO, libc::TIOCGWINSZ, &raw mut size) };
    let or = |asked: u16, default| if status == 0 && asked > 0 { usize::from(asked) } else { default };
    (or(size.ws_col, 80), or(size.ws_row, 24))
}
