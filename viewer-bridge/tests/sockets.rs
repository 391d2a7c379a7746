//! The server over real sockets: access control, delivery, and clients that are slow, silent or too
//! talkative. There is no node: the tests feed the hub.

mod delivery;
mod foxglove;
mod foxglove_client;
mod hostile;
mod intruders;
mod misuse;
mod raw_socket;
mod support;
