//! Attacks: Python programs that print `SUCCESS` if they reach something that they should not.
//!
//! Every program is preceded by [`PRELUDE`] and by the values of [`Target`](super::Target) as
//! variables.

/// An attack of a hostile command.
pub struct Attack {
    /// Name in the tables.
    pub name: &'static str,
    /// Goal of the attack, for the documentation.
    pub aim: &'static str,
    /// Python text.
    pub script: &'static str,
    /// True if it requires the rights of the root user to succeed without a sandbox.
    pub needs_root: bool,
    /// Evidence of success, in addition to the program's output.
    pub proof: Proof,
}

/// Evidence of the success of an attack.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Proof {
    /// The program prints `SUCCESS`.
    Word,
    /// The files of the caller have changed.
    Files,
    /// A process of the attack remains after the end of the command.
    Survivor,
    /// The command still runs after SIGTERM.
    Unstoppable,
}

/// Imports and helper functions of all attacks.
pub const PRELUDE: &str = r#"
import ctypes, errno, mmap, os, signal, socket, struct, subprocess, sys, threading, time
libc = ctypes.CDLL(None, use_errno=True)
def success():
    print("SUCCESS", flush=True)
    os._exit(0)
def call(number, *arguments):
    ctypes.set_errno(0)
    return libc.syscall(ctypes.c_long(number), *[ctypes.c_long(a) if isinstance(a, int) else a for a in arguments])
def denied():
    return ctypes.get_errno() in (errno.EPERM, errno.EACCES, errno.ENOSYS)
def has(path):
    with open(path, "rb") as file:
        return SECRET.encode() in file.read()
X86 = os.uname().machine == "x86_64"
"#;

const fn word(name: &'static str, aim: &'static str, script: &'static str) -> Attack {
    Attack { name, aim, script, needs_root: false, proof: Proof::Word }
}

const fn root(name: &'static str, aim: &'static str, script: &'static str) -> Attack {
    Attack { name, aim, script, needs_root: true, proof: Proof::Word }
}

const fn shown(
    name: &'static str,
    aim: &'static str,
    script: &'static str,
    proof: Proof,
) -> Attack {
    Attack { name, aim, script, needs_root: false, proof }
}

/// All attacks.
pub const ATTACKS: &[Attack] = &[
    // Secrets of the caller.
    word("read-run-folder", "read the run's files", "if has(RUN + '/secret'): success()"),
    word(
        "read-masked-file",
        "read a hidden file in a readable folder",
        "if has(READABLE + '/answers'): success()",
    ),
    word(
        "read-through-link",
        "read the run's files through a link in its own folder",
        "os.symlink(RUN + '/secret', 'link')\nif has('link'): success()",
    ),
    word(
        "read-hard-link",
        "hard-link the run's files into its own folder",
        "os.link(RUN + '/secret', OWN + '/hard')\nif has(OWN + '/hard'): success()",
    ),
    word(
        "read-through-proc-root",
        "read the run's files through another process's root folder",
        "for pid in ('1', 'self', str(CALLER)):\n    try:\n        if has(f'/proc/{pid}/root{RUN}/secret'): success()\n    except OSError: pass",
    ),
    word(
        "read-descriptors",
        "read the caller's open files through /proc",
        "for fd in range(1000):\n    try:\n        with open(f'/proc/{CALLER}/fd/{fd}', 'rb', buffering=0) as f:\n            if fd > 2 and SECRET.encode() in os.pread(f.fileno(), 1 << 16, 0): success()\n    except OSError: pass",
    ),
    word(
        "inherit-descriptors",
        "read descriptors that the caller left open",
        "for fd in range(3, 1000):\n    try:\n        if SECRET.encode() in os.pread(fd, 1 << 16, 0): success()\n    except OSError: pass",
    ),
    word(
        "read-memory",
        "read the caller's memory through /proc",
        r#"
with open(f'/proc/{CALLER}/maps') as maps, open(f'/proc/{CALLER}/mem', 'rb', 0) as mem:
    for line in maps:
        span, rights = line.split()[:2]
        if not rights.startswith('rw'): continue
        start, end = (int(x, 16) for x in span.split('-'))
        try:
            mem.seek(start)
            if SECRET.encode() in mem.read(min(end - start, 1 << 26)): success()
        except (OSError, OverflowError, ValueError): pass
"#,
    ),
    word(
        "read-memory-directly",
        "read the caller's memory by process_vm_readv",
        r#"
number = 310 if X86 else 270
buffer = ctypes.create_string_buffer(64)
local = struct.pack('QQ', ctypes.addressof(buffer), 64)
remote = struct.pack('QQ', 0x10000, 64)
call(number, CALLER, ctypes.c_char_p(local), 1, ctypes.c_char_p(remote), 1, 0)
# Without the right to it, the call fails before it looks at the address.
if ctypes.get_errno() in (0, errno.EFAULT): success()
"#,
    ),
    word(
        "read-environment",
        "read the caller's environment",
        "if has(f'/proc/{CALLER}/environ'): success()",
    ),
    word(
        "own-environment",
        "find keys in its own environment",
        "if any('KEY' in name for name in os.environ): success()",
    ),
    word(
        "read-command-line",
        "read the caller's command line",
        "if open(f'/proc/{CALLER}/cmdline', 'rb').read(): success()",
    ),
    word(
        "run-caller-program",
        "run the caller's program to list goals",
        "out = subprocess.run([f'/proc/{CALLER}/exe', '--print-goal'], capture_output=True).stdout\nif b'GOAL' in out: success()",
    ),
    word(
        "run-first-program",
        "run the program of the first process of the sandbox",
        "for pid in os.listdir('/proc'):\n    if not pid.isdigit(): continue\n    try:\n        out = subprocess.run([f'/proc/{pid}/exe', '--print-goal'], capture_output=True, timeout=5).stdout\n        if b'GOAL' in out: success()\n    except (OSError, subprocess.TimeoutExpired): pass",
    ),
    word(
        "list-processes",
        "see the caller among the processes",
        "if os.path.exists(f'/proc/{CALLER}/status') and f'PPid:' in open(f'/proc/{CALLER}/status').read() and NAME in open(f'/proc/{CALLER}/cmdline').read(): success()",
    ),
    // Other helpers and the machine.
    word(
        "read-other-helper",
        "read the private files of another helper",
        "for top, _, files in os.walk('/tmp'):\n    for name in files:\n        try:\n            if name == 'of-another' and has(os.path.join(top, name)): success()\n        except OSError: pass",
    ),
    root(
        "read-passwords",
        "read the system's password file",
        "if open('/etc/shadow').read(): success()",
    ),
    word("read-home", "read the user's home folder", "if has(HOME_FILE): success()"),
    root(
        "read-disk",
        "read the disk's block device",
        "for name in os.listdir('/dev'):\n    if name.startswith(('vd', 'sd', 'nvme', 'xvd')):\n        try:\n            with open('/dev/' + name, 'rb', 0) as f:\n                if f.read(512): success()\n        except OSError: pass",
    ),
    root(
        "make-device",
        "make a device file",
        "os.mknod(OWN + '/mem', 0o20600, os.makedev(1, 1))\nsuccess()",
    ),
    word(
        "read-kernel-log",
        "read the kernel log",
        "if call(103 if X86 else 116, 10, 0, 0) >= 0: success()",
    ),
    // Changes.
    shown(
        "write-run-folder",
        "append a forged result to the run",
        "open(RUN + '/results', 'a').write('forged')",
        Proof::Files,
    ),
    shown(
        "write-start-folder",
        "leave a file in the start folder",
        "open('left', 'w').write('x')",
        Proof::Files,
    ),
    shown(
        "write-readable",
        "change a file that is only readable",
        "open(READABLE + '/program.py', 'a').write('changed')",
        Proof::Files,
    ),
    shown(
        "remove-readable",
        "remove a file that is only readable",
        "os.remove(READABLE + '/program.py')",
        Proof::Files,
    ),
    root(
        "write-system",
        "write to a system folder",
        "path = '/usr/local/chaic-attack'\nopen(path, 'w').write('x')\nos.remove(path)\nsuccess()",
    ),
    root(
        "change-kernel-settings",
        "set a kernel parameter to its present value",
        "path = '/proc/sys/kernel/core_pattern'\nheld = open(path).read()\nopen(path, 'w').write(held)\nsuccess()",
    ),
    root(
        "make-control-group",
        "make a control group to escape the limits",
        "path = '/sys/fs/cgroup/unified/chaic-attack'\nif not os.path.isdir(os.path.dirname(path)): path = '/sys/fs/cgroup/chaic-attack'\nos.mkdir(path)\nos.rmdir(path)\nsuccess()",
    ),
    // Network.
    word(
        "connect-tcp",
        "connect to a server of this machine",
        "socket.create_connection(('127.0.0.1', PORT), 5)\nsuccess()",
    ),
    word(
        "send-udp",
        "send a datagram",
        "s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)\ns.sendto(b'x', ('127.0.0.1', PORT))\nsuccess()",
    ),
    word(
        "connect-abstract",
        "connect to an abstract local socket",
        "s = socket.socket(socket.AF_UNIX)\ns.connect('\\0' + ABSTRACT)\nsuccess()",
    ),
    word(
        "connect-local",
        "connect to a local socket of the caller",
        "s = socket.socket(socket.AF_UNIX)\ns.connect(RUN + '/socket')\nsuccess()",
    ),
    word(
        "ask-for-routes",
        "open a netlink socket to query routes",
        "s = socket.socket(16, socket.SOCK_RAW, 0)\nsuccess()",
    ),
    root(
        "raw-socket",
        "open a raw socket",
        "socket.socket(socket.AF_INET, socket.SOCK_RAW, 1)\nsuccess()",
    ),
    // Processes.
    word(
        "signal-caller",
        "signal the caller",
        "os.kill(CALLER, 0)\nif NAME in open(f'/proc/{CALLER}/cmdline').read(): success()",
    ),
    word(
        "signal-all",
        "signal all processes",
        "before = [p for p in os.listdir('/proc') if p.isdigit()]\nif str(CALLER) in before and NAME in open(f'/proc/{CALLER}/cmdline').read():\n    os.kill(CALLER, 0)\n    success()",
    ),
    word(
        "trace-caller",
        "trace the caller",
        "number = 101 if X86 else 117\nr = call(number, 0x4206, CALLER, 0, 0)\nif r == 0:\n    call(number, 17, CALLER, 0, 0)\n    success()",
    ),
    word(
        "trace-child",
        "trace one of its own child processes",
        "pid = os.fork()\nif pid == 0:\n    time.sleep(5)\n    os._exit(0)\nr = call(101 if X86 else 117, 0x4206, pid, 0, 0)\nos.kill(pid, 9)\nif r == 0: success()",
    ),
    shown(
        "outlive",
        "leave a process behind in another session",
        "if os.fork() == 0:\n    os.setsid()\n    if os.fork() == 0:\n        for fd in range(3): os.close(fd)\n        os.execvp('sleep', ['sleep', SURVIVOR])\n    os._exit(0)\nos.wait()",
        Proof::Survivor,
    ),
    shown(
        "outlive-kill",
        "leave a process behind after SIGKILL of the command",
        "if os.fork() == 0:\n    os.setsid()\n    os.execvp('sleep', ['sleep', SURVIVOR])\ntime.sleep(0.3)\nos.kill(os.getpid(), 9)",
        Proof::Survivor,
    ),
    shown(
        "endless-loop",
        "continue after SIGTERM",
        "signal.signal(signal.SIGTERM, signal.SIG_IGN)\nsignal.signal(signal.SIGHUP, signal.SIG_IGN)\nprint('READY', flush=True)\nwhile True: pass",
        Proof::Unstoppable,
    ),
    // Resources: the tests allow 192 MiB of memory, 48 MiB of files and 64 tasks.
    word(
        "fork-bomb",
        "run more processes than allowed",
        "pids = []\nfor _ in range(160):\n    pid = os.fork()\n    if pid == 0:\n        time.sleep(30)\n        os._exit(0)\n    pids.append(pid)\ntime.sleep(0.5)\nfor pid in pids: os.kill(pid, 9)\nsuccess()",
    ),
    word(
        "thread-bomb",
        "run more threads than allowed",
        "threading.stack_size(65536)\nfor _ in range(160): threading.Thread(target=time.sleep, args=(30,), daemon=True).start()\ntime.sleep(0.5)\nsuccess()",
    ),
    word(
        "memory-map",
        "use more memory than allowed in one process",
        "m = mmap.mmap(-1, 400 << 20, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)\nfor at in range(0, 400 << 20, 4096): m[at] = 1\ntime.sleep(0.2)\nsuccess()",
    ),
    word(
        "reserve-100-gib",
        "reserve 100 GiB of memory",
        "m = mmap.mmap(-1, 100 << 30, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)\nfor at in range(0, 1 << 30, 4096): m[at] = 1\ntime.sleep(0.2)\nsuccess()",
    ),
    word(
        "memory-of-children",
        "use more memory than allowed in many processes",
        "for _ in range(8):\n    if os.fork() == 0:\n        hold = bytearray(os.urandom(1 << 16) * (50 << 4))\n        time.sleep(30)\ntime.sleep(3)\nsuccess()",
    ),
    word(
        "memory-shared",
        "use more memory than allowed in shared pages",
        "m = mmap.mmap(-1, 400 << 20)\nfor at in range(0, 400 << 20, 4096): m[at] = 1\ntime.sleep(0.2)\nsuccess()",
    ),
    word(
        "memory-files",
        "fill memory with anonymous files (memfd)",
        "fd = os.memfd_create('x')\nfor _ in range(400): os.write(fd, bytes(1 << 20))\nsuccess()",
    ),
    word(
        "memory-segments",
        "use memory in System V segments",
        "if call(29 if X86 else 194, 0, 1 << 20, 0o1600) < 0: sys.exit()\nlibc.shmctl(libc.shmget(0, 1, 0o1600), 0, None)\nsuccess()",
    ),
    word(
        "memory-semaphores",
        "use memory of the kernel in System V semaphores",
        "made = libc.semget(0, 1000, 0o1600)\nif made < 0: sys.exit()\nlibc.semctl(made, 0, 0)\nsuccess()",
    ),
    word(
        "memory-messages",
        "use memory of the kernel in System V messages",
        "made = libc.msgget(0, 0o1600)\nif made < 0: sys.exit()\nlibc.msgctl(made, 0, None)\nsuccess()",
    ),
    word(
        "fill-shared-memory",
        "fill the folder of shared memory",
        "with open('/dev/shm/chaic-attack', 'wb') as f:\n    os.remove('/dev/shm/chaic-attack')\n    for _ in range(100): f.write(bytes(1 << 20))\nsuccess()",
    ),
    word(
        "fill-disk",
        "fill the temporary folder",
        "with open('/tmp/chaic-attack', 'wb') as f:\n    os.remove('/tmp/chaic-attack')\n    for _ in range(100): f.write(bytes(1 << 20))\nsuccess()",
    ),
    word(
        "flood-descriptors",
        "open 9,000 files",
        "import resource\nresource.setrlimit(resource.RLIMIT_NOFILE, (10000, 10000))\nheld = [os.open('/dev/null', 0) for _ in range(9000)]\nsuccess()",
    ),
    // Rights.
    root("become-another-user", "take another user's identity", "os.setuid(12345)\nsuccess()"),
    root("change-root", "take another root folder", "os.chroot('/')\nsuccess()"),
    root(
        "mount",
        "mount a file system",
        "call(165 if X86 else 40, ctypes.c_char_p(b'none'), ctypes.c_char_p(b'/chaic-nowhere'), ctypes.c_char_p(b'tmpfs'), 0, 0)\nif not denied(): success()",
    ),
    word(
        "new-user-namespace",
        "become the root user of a new namespace",
        "if libc.unshare(0x10000000) == 0: success()",
    ),
    word(
        "clone-namespace",
        "become the root user of a cloned namespace",
        "pid = call(56 if X86 else 220, 0x10000000 | 17, 0, 0, 0, 0)\nif pid == 0: os._exit(0)\nif pid > 0: success()",
    ),
    word(
        "enter-namespace",
        "enter the caller's namespaces",
        "fd = os.open(f'/proc/{CALLER}/ns/user', 0)\ncall(308 if X86 else 268, fd, 0)\nif NAME in open(f'/proc/{CALLER}/cmdline').read() and ctypes.get_errno() != errno.EPERM: success()",
    ),
    root(
        "set-host-name",
        "set the host name to its present value",
        "socket.sethostname(socket.gethostname())\nsuccess()",
    ),
    word(
        "use-io-uring",
        "use io_uring, whose operations bypass system call filters",
        "params = ctypes.create_string_buffer(120)\nif call(425, 4, params) >= 0: success()",
    ),
    root(
        "load-bpf",
        "load a program into the kernel",
        "attr = ctypes.create_string_buffer(struct.pack('IIII', 2, 4, 8, 4) + bytes(112), 128)\nif call(321 if X86 else 280, 0, attr, 128) >= 0: success()",
    ),
    word(
        "use-keyring",
        "read the keys of the user's session",
        "if call(250 if X86 else 219, 0, -3, 1) >= 0: success()",
    ),
    root(
        "handle-of-file",
        "open a file by its handle, without a path",
        "h = ctypes.create_string_buffer(struct.pack('Ii', 128, 0) + bytes(128), 136)\nm = ctypes.c_int()\nif libc.name_to_handle_at(-100, ctypes.c_char_p(b'/usr'), h, ctypes.byref(m), 0) < 0: sys.exit()\nfd = os.open('/usr', 0)\nif libc.open_by_handle_at(fd, h, 0) >= 0: success()",
    ),
    word(
        "raise-limits",
        "raise its own resource limits",
        "import resource\nresource.setrlimit(resource.RLIMIT_CORE, (1 << 20, 1 << 20))\nsuccess()",
    ),
    root(
        "raise-priority",
        "raise its priority to the highest",
        "os.setpriority(os.PRIO_PROCESS, 0, -20)\nsuccess()",
    ),
];
