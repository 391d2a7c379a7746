//! Numbers with their nouns.

/// Returns a number with its noun, such as "1 particle" or "2 particles".
pub fn counted(count: impl Into<u64>, noun: &str) -> String {
    let count = count.into();
    let ending = if count == 1 { "" } else { "s" };
    format!("{count} {noun}{ending}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_one_is_singular() {
        let texts = [0_u32, 1, 2].map(|count| counted(count, "snapshot"));
        assert_eq!(texts, ["0 snapshots", "1 snapshot", "2 snapshots"]);
    }
}
