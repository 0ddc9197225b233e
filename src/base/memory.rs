//! Checks memory before it is taken.

use crate::base::error::{Error, Result};

/// Fails with one sentence if `need` bytes (`None`: the sum overflowed) are not available now.
///
/// # Errors
/// [`Error::Memory`].
pub fn ensure_available(what: &str, need: Option<u64>) -> Result<()> {
    let available = available_bytes();
    match need {
        Some(need) if need <= available => Ok(()),
        _ => Err(Error::Memory {
            what: what.to_owned(),
            need_mib: need.unwrap_or(u64::MAX) >> 20,
            available_mib: available >> 20,
        }),
    }
}

/// Memory that can be taken without swapping, in bytes: the smaller of what the machine and the
/// control group have left.
pub fn available_bytes() -> u64 {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let machine = system.available_memory();
    system.cgroup_limits().map_or(machine, |group| machine.min(group.free_memory))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_had_is_refused() {
        assert!(ensure_available("a byte", Some(1)).is_ok());
        for need in [None, Some(u64::MAX)] {
            assert!(matches!(ensure_available("all", need), Err(Error::Memory { .. })));
        }
    }
}
