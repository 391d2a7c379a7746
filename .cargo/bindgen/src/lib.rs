//! Nothing: the build scripts of iceoryx2 call bindgen on QNX alone.
