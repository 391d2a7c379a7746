//! The user of this process.

use std::path::PathBuf;

/// A user of the system.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct User {
    /// Name, or the number of a user without one.
    pub(super) name: String,
    pub(super) home: Option<PathBuf>,
}

impl User {
    /// Finds a user in the text of `/etc/passwd`, where iceoryx2 looks for the home folder, too.
    pub(super) fn find(passwd: &str, id: u32) -> Self {
        let number = id.to_string();
        let fields = |line: &str| line.split(':').map(ToOwned::to_owned).collect::<Vec<_>>();
        let is_user = |fields: &Vec<String>| fields.get(2) == Some(&number);
        match passwd.lines().map(fields).find(is_user) {
            Some(fields) => {
                Self { name: fields[0].clone(), home: fields.get(5).map(PathBuf::from) }
            }
            None => Self { name: number, home: None },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_user_is_found_by_number_and_an_unknown_one_has_no_home() {
        let passwd =
            "root:x:0:0:root:/root:/bin/sh\nada:x:1000:1000::/home/ada:/bin/sh\nshort:x:1\n";
        let user = |name: &str, home: Option<&str>| User {
            name: name.to_owned(),
            home: home.map(PathBuf::from),
        };
        assert_eq!(User::find(passwd, 1000), user("ada", Some("/home/ada")));
        assert_eq!(User::find(passwd, 1), user("short", None));
        assert_eq!(User::find(passwd, 7), user("7", None));
    }
}
