//! The page in a real browser, with the built node and bridge. The tests send mouse, touch and key
//! events, and check the snapshots of the node and the pixels of the page. An error of a page fails
//! its test. No speed is asserted.

mod access;
mod carry;
mod colours;
mod first_minute;
mod forces;
mod inspector;
mod pages;
mod picture;
mod pointer;
mod replay;
mod support;
mod time;

/// Effects, and the uniforms of the shaders.
mod drawing {
    mod effects;
    mod uniforms;
}

/// Recordings, pictures and videos of the page.
mod save {
    mod files;
    mod recording;
    mod video;
}

/// Looks back, and changes that are undone.
mod past {
    mod history;
    mod undo;
}
