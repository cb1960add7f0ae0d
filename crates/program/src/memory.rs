//! Settings of glibc's allocator for the process. Other C libraries keep theirs.

#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod glibc {
    use std::ffi::c_int;

    // SAFETY: declared as in mallopt(3) and malloc_trim(3). They can be called at any time and leave memory in use where it is.
    unsafe extern "C" {
        pub safe fn mallopt(param: c_int, value: c_int) -> c_int;
        pub safe fn malloc_trim(pad: usize) -> c_int;
    }

    pub const M_MMAP_THRESHOLD: c_int = -3;
}

/// Least size in bytes of memory that goes back to the system when it is freed: a texture of 512 x 512 texels and more.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE: std::ffi::c_int = 1 << 20;

/// Has large pieces of memory go back to the system when they are freed. By default glibc keeps pieces up to the size of the largest one that was
/// freed before, at most 32 MiB: texels that have been uploaded would stay.
pub fn give_back_large_pieces() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    glibc::mallopt(glibc::M_MMAP_THRESHOLD, LARGE);
}

/// Gives freed memory back to the system. glibc keeps memory that lies below a living allocation.
pub fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    glibc::malloc_trim(0);
}
