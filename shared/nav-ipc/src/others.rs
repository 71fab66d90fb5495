//! Programs of other users, which ours can neither see nor be seen by.

use crate::config::IpcConfig;
use crate::leftovers;
use crate::user;
use std::fs;

/// A sentence about the users who have topics open in their own worlds ([`IpcConfig::default`]) while this program waits in
/// ours; nothing when there are none, or when a folder was given that all of them would use.
///
/// For whoever waits: a robot's programs that were started as two users wait for each other for ever.
pub fn programs_of_other_users(config: &IpcConfig) -> Option<String> {
    if *config != IpcConfig::default() {
        return None;
    }
    let worlds = fs::read_dir("/tmp").into_iter().flatten().flatten().filter_map(|entry| {
        let name = entry.file_name();
        let user = name.to_str()?.strip_prefix("hybridnav-")?.parse::<u32>().ok()?;
        (user != user::id()).then_some((user, IpcConfig::of_user(user)))
    });
    // Each topic has shared memory, whose names everybody can see; the counter of nodes stays when the last one is gone.
    let busy = worlds.filter(|(_, world)| {
        leftovers::shared_files(world).any(|path| path.extension().is_some_and(|kind| kind == "dynamic"))
    });
    let busy: Vec<_> = busy
        .map(|(user, world)| format!("user {} under {}", user::name(user), world.root().display()))
        .collect();
    (!busy.is_empty()).then(|| {
        format!(
            "topics are also open for {}; this program runs as user {} and cannot see them: run all programs of a robot as \
             the same user",
            busy.join(", "),
            user::name(user::id())
        )
    })
}
