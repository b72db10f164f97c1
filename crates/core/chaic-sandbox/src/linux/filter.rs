//! Filter of system calls.

use std::collections::BTreeMap;

use libc::c_long;
use seccompiler::{
    BpfProgram, Error, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition,
    SeccompFilter, SeccompRule, TargetArch, apply_filter,
};

/// System calls that always fail with `EPERM`, grouped by what a command could reach through them.
const DENIED: &[c_long] = &[
    // Other processes.
    libc::SYS_ptrace,
    libc::SYS_process_vm_readv,
    libc::SYS_process_vm_writev,
    libc::SYS_process_madvise,
    libc::SYS_kcmp,
    libc::SYS_pidfd_getfd,
    libc::SYS_perf_event_open,
    // Namespaces and mounts.
    libc::SYS_unshare,
    libc::SYS_setns,
    libc::SYS_mount,
    libc::SYS_umount2,
    libc::SYS_pivot_root,
    libc::SYS_chroot,
    libc::SYS_open_tree,
    libc::SYS_move_mount,
    libc::SYS_fsopen,
    libc::SYS_fsconfig,
    libc::SYS_fsmount,
    libc::SYS_fspick,
    libc::SYS_mount_setattr,
    libc::SYS_open_by_handle_at,
    libc::SYS_name_to_handle_at,
    // Memory outside the limits: files without a folder, and System V objects.
    libc::SYS_memfd_create,
    libc::SYS_memfd_secret,
    libc::SYS_shmget,
    libc::SYS_semget,
    libc::SYS_msgget,
    libc::SYS_mq_open,
    // The kernel itself, and interfaces with a history of kernel vulnerabilities.
    libc::SYS_bpf,
    libc::SYS_io_uring_setup,
    libc::SYS_io_uring_enter,
    libc::SYS_io_uring_register,
    libc::SYS_userfaultfd,
    libc::SYS_keyctl,
    libc::SYS_add_key,
    libc::SYS_request_key,
    libc::SYS_init_module,
    libc::SYS_finit_module,
    libc::SYS_delete_module,
    libc::SYS_kexec_load,
    libc::SYS_kexec_file_load,
    libc::SYS_reboot,
    libc::SYS_swapon,
    libc::SYS_swapoff,
    libc::SYS_acct,
    libc::SYS_quotactl,
    libc::SYS_syslog,
    libc::SYS_settimeofday,
    libc::SYS_clock_settime,
    libc::SYS_clock_adjtime,
    libc::SYS_adjtimex,
    libc::SYS_sethostname,
    libc::SYS_setdomainname,
    libc::SYS_fanotify_init,
    libc::SYS_vhangup,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_iopl,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_ioperm,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_modify_ldt,
];

/// Flags of `clone` that create namespaces.
const NAMESPACE_FLAGS: &[i32] = &[
    libc::CLONE_NEWUSER,
    libc::CLONE_NEWPID,
    libc::CLONE_NEWNS,
    libc::CLONE_NEWNET,
    libc::CLONE_NEWIPC,
    libc::CLONE_NEWUTS,
    libc::CLONE_NEWCGROUP,
];

/// Commands of `ioctl` that insert input into a terminal.
const TERMINAL_INPUT: &[u64] = &[0x5412, 0x541c];

type Rules = BTreeMap<i64, Vec<SeccompRule>>;

/// Applies the filter to this process and its descendants. `local_sockets` allows sockets of the
/// address family `AF_UNIX`, which a private root folder separates from those of the system.
pub(super) fn apply(local_sockets: bool) -> Result<(), Error> {
    // glibc then falls back to `clone`, whose flags a filter can read.
    let missing = Rules::from([(libc::SYS_clone3, Vec::new())]);
    for (rules, errno) in [(missing, libc::ENOSYS), (denied(local_sockets)?, libc::EPERM)] {
        apply_filter(&program(rules, errno)?)?;
    }
    Ok(())
}

fn denied(local_sockets: bool) -> Result<Rules, Error> {
    let mut rules: Rules = DENIED.iter().map(|call| (*call, Vec::new())).collect();
    let when = |argument: u8, op: SeccompCmpOp, value: u64| {
        let condition = SeccompCondition::new(argument, SeccompCmpArgLen::Dword, op, value)?;
        SeccompRule::new(vec![condition])
    };
    let has_flag = |flag: &i32| {
        let flag = u64::from(flag.unsigned_abs());
        when(0, SeccompCmpOp::MaskedEq(flag), flag)
    };
    let flags: Result<_, _> = NAMESPACE_FLAGS.iter().map(has_flag).collect();
    rules.insert(libc::SYS_clone, flags.map_err(Error::Backend)?);
    let inputs: Result<_, _> =
        TERMINAL_INPUT.iter().map(|command| when(1, SeccompCmpOp::Eq, *command)).collect();
    rules.insert(libc::SYS_ioctl, inputs.map_err(Error::Backend)?);
    let other_family = when(0, SeccompCmpOp::Ne, libc::AF_UNIX as u64).map_err(Error::Backend)?;
    rules.insert(libc::SYS_socket, if local_sockets { vec![other_family] } else { Vec::new() });
    Ok(rules)
}

fn program(rules: Rules, errno: i32) -> Result<BpfProgram, Error> {
    /// Bit of a system call of the x32 interface, which shares the numbers of x86-64.
    #[cfg(target_arch = "x86_64")]
    const X32: i64 = 0x4000_0000;
    #[cfg(target_arch = "x86_64")]
    let rules: Rules =
        rules.into_iter().flat_map(|(call, r)| [(call | X32, r.clone()), (call, r)]).collect();
    let architecture = TargetArch::try_from(std::env::consts::ARCH).map_err(Error::Backend)?;
    let action = SeccompAction::Errno(errno.unsigned_abs());
    let filter = SeccompFilter::new(rules, SeccompAction::Allow, action, architecture);
    filter.and_then(BpfProgram::try_from).map_err(Error::Backend)
}
