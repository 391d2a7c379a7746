//! An address of this host that other machines can reach.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, UdpSocket};

/// Addresses in the networks that are reserved for documents. The system chooses the own address for a
/// way there, as for any address far away.
const FAR_V4: IpAddr = IpAddr::V4(Ipv4Addr::new(198, 51, 100, 1));
const FAR_V6: IpAddr = IpAddr::V6(Ipv6Addr::new(0x2001, 0xdb8, 0, 0, 0, 0, 0, 1));
/// Any port: nothing is sent.
const PORT: u16 = 9;

/// Returns the own address on the way to other networks, for a server that listens at all addresses of
/// the family of `listen`. Returns `None` without a way there.
pub(super) fn local_address(listen: IpAddr) -> Option<IpAddr> {
    // A server at all addresses of IPv6 also accepts IPv4, which more people can type.
    let families: &[IpAddr] = if listen.is_ipv4() { &[FAR_V4] } else { &[FAR_V4, FAR_V6] };
    families.iter().find_map(|far| address_towards(*far))
}

/// The system chooses the own address of a socket when it is connected. A datagram socket sends nothing
/// for that.
fn address_towards(far: IpAddr) -> Option<IpAddr> {
    let any = match far {
        IpAddr::V4(_) => IpAddr::V4(Ipv4Addr::UNSPECIFIED),
        IpAddr::V6(_) => IpAddr::V6(Ipv6Addr::UNSPECIFIED),
    };
    let socket = UdpSocket::bind((any, 0)).ok()?;
    socket.connect((far, PORT)).ok()?;
    let own = socket.local_addr().ok()?.ip();
    (!own.is_unspecified() && !own.is_loopback()).then_some(own)
}
