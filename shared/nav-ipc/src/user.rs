//! Users, by number and for people.

/// The user this process acts as.
pub(crate) fn id() -> u32 {
    // SAFETY: always succeeds.
    unsafe { libc::geteuid() }
}

/// `1000 (ada)`, or the number alone for a user without a name.
pub(crate) fn name(id: u32) -> String {
    let users = std::fs::read_to_string("/etc/passwd").unwrap_or_default();
    let name = users.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        (fields.nth(1)?.parse() == Ok(id)).then_some(name)
    });
    name.map_or_else(|| id.to_string(), |name| format!("{id} ({name})"))
}

#[cfg(test)]
mod tests {
    #[test]
    fn users_are_named_where_they_have_a_name() {
        assert_eq!(super::name(0), "0 (root)");
        assert_eq!(super::name(3_999_999_999), "3999999999");
    }
}
