"""What a hand-in may try against the machine that checks it: a few lines of Python each, which
return something if they have obtained what they wanted."""

# Nothing of these may be obtained. SECRET: a file that only the grader may read, in CLASS, the
# folder of a class; PARENT: the process that checks; PROJECT: the folder of this project.
FORBIDDEN: dict[str, str] = {
    # the reference, by import and by path
    "import of the reference": (
        "import crosscheck2d.reference_impl.exercise as e; return e.advance"
    ),
    "import by its folder": "return __import__('reference_impl' + '.exercise').exercise.advance",
    "import beside itself": "from .exercise import advance; return advance",
    "import of the judge": "import crosscheck2d.reports.check.motion as m; return m",
    "import of the judge's folder": "return __import__('reports' + '.check')",
    "import of the adapters": "import crosscheck2d.adapters.host.process as p; return p",
    "import by importlib": (
        "from importlib import import_module as i; return i('crosscheck2d.reports.check')"
    ),
    "path extended": (
        "sys.path[:0] = [PROJECT, os.path.dirname(PROJECT)]\n"
        "return __import__('reference_impl.exercise')"
    ),
    "text opened and run": "return open(PROJECT + '/reference_impl/exercise.py').read()",
    "found by numpy's place": (
        "import numpy; f = os.path.dirname(numpy.__file__)\n"
        "for _ in range(6):\n"
        "    f = os.path.dirname(f)\n"
        "    if os.path.exists(f + '/reference_impl'): return f"
    ),
    "in sys.modules or gc": (
        "import gc; names = ('reports', 'scenarios', 'adapters', 'exercise')\n"
        "ours = lambda name: any(part in names for part in str(name).split('.'))\n"
        "return [m for m in sys.modules if ours(m)] or [\n"
        "    o for o in gc.get_objects() if ours(type(o).__module__)\n"
        "]"
    ),
    "linker: C source beside": "import linecache; return linecache.getlines(SECRET)",
    # files
    "neighbour's file": "return open(SECRET).read()",
    "listing of the class": "return os.listdir(CLASS)",
    "by a symbolic link": "os.symlink(SECRET, '/tmp/link'); return open('/tmp/link').read()",
    "by a hard link": "os.link(SECRET, '/tmp/hard'); return open('/tmp/hard').read()",
    "by the root of the parent": "return open(f'/proc/{PARENT}/root' + SECRET).read()",
    "by the folder of the parent": "return os.listdir(f'/proc/{PARENT}/cwd')",
    "environment of the parent": "return open(f'/proc/{PARENT}/environ', 'rb').read()",
    "command lines": "return open(f'/proc/{PARENT}/cmdline', 'rb').read()",
    "own environment": (
        "known = ('PWD', 'LC_', 'OPENBLAS_', 'OMP_', 'NUMBA_')\n"
        "return [x for x in os.environ if not x.startswith(known)] or CLASS in str(os.environ)"
    ),
    "own command line": "return CLASS in ' '.join(sys.orig_argv)",
    "own place": "return CLASS in os.getcwd() + __file__",
    "memory of the parent": "return open(f'/proc/{PARENT}/mem', 'rb').read(1)",
    "handles of the parent": "return os.listdir(f'/proc/{PARENT}/fd')",
    "inherited handles": (
        "for n in range(3, 64):\n"
        "    try: name = os.readlink(f'/proc/self/fd/{n}')\n"
        "    except OSError: continue\n"
        "    if not name.startswith(('pipe', 'anon', '/dev/null')): return name\n"
        "return any(os.path.isdir(f'/dev/fd/{n}') for n in range(3, 64))"
    ),
    "write a file beside": "open(CLASS + '/marks.csv', 'w').write('20'); return True",
    "write the standard library": "open(os.__file__, 'a').write('#'); return True",
    "write numpy's folder": (
        "import numpy; open(os.path.dirname(numpy.__file__) + '/x.py', 'w'); return True"
    ),
    "write the driver": "open(sys.argv[0], 'a').write('#'); return True",
    "write /var/tmp": "open('/var/tmp/crosscheck-attack', 'w'); return True",
    "write /dev/shm": "open('/dev/shm/crosscheck-attack', 'w'); return True",
    "chmod of others": "os.chmod(SECRET, 0o777); return True",
    "utime of others": "os.utime(SECRET); return True",
    "stat of others": "return os.stat(SECRET)",
    "chroot away": "os.chroot('/tmp'); return True",
    "home folder": "return os.listdir(os.path.expanduser('~/.ssh')) or True",
    "passwords": "return open('/etc/shadow').read()",
    "core pattern": "open('/proc/sys/kernel/core_pattern', 'w'); return True",
    # other processes
    "process_vm_readv": (
        "b = ctypes.create_string_buffer(64)\n"
        "io = (ctypes.c_void_p * 2)(ctypes.addressof(b), 8)\n"
        "return LIBC.process_vm_readv(PARENT, io, 1, io, 1, 0) > 0"
    ),
    "ptrace": "return LIBC.ptrace(16, PARENT, 0, 0) == 0",
    "pidfd_getfd": "fd = os.pidfd_open(PARENT); return LIBC.syscall(438, fd, 0, 0) >= 0",
    "stop the parent": "os.kill(PARENT, signal.SIGSTOP); return True",
    "kill the parent": "os.kill(PARENT, signal.SIGKILL); return True",
    "kill everything": "os.kill(-1, 0); return True",
    "kill the group of the parent": "os.killpg(PARENT, 0); return True",
    "signal by F_SETOWN": "import fcntl; r, w = os.pipe(); fcntl.fcntl(r, 8, PARENT); return True",
    "tgkill": "return LIBC.syscall(234, PARENT, PARENT, 0) == 0",
    "prlimit of the parent": (
        "import resource; resource.prlimit(PARENT, resource.RLIMIT_CPU, (1, 1)); return True"
    ),
    "pin the parent to a core": "os.sched_setaffinity(PARENT, {0}); return True",
    "priority of the parent": "os.setpriority(os.PRIO_PROCESS, PARENT, 19); return True",
    # out of the machine, or into the kernel
    "tcp to the machine": "import socket; socket.create_connection((HOST, PORT), 1); return True",
    "udp to the net": (
        "import socket; s = socket.socket(2, 2); s.connect(('192.0.2.1', 9)); return True"
    ),
    "name of a host": "import socket; return socket.gethostbyname('example.com')",
    "abstract socket of the parent": (
        "import socket; s = socket.socket(1); s.connect('\\0' + NAME); return True"
    ),
    "exec of a shell": "os.execv('/bin/sh', ['sh', '-c', 'exit']); return True",
    "subprocess": "import subprocess; return subprocess.run(['/bin/ls', '/']).returncode == 0",
    "posix_spawn": "return os.posix_spawn('/bin/ls', ['ls'], {})",
    "unshare a user namespace": "return LIBC.unshare(0x10000000) == 0",
    "unshare mounts": "return LIBC.unshare(0x00020000) == 0",
    "mount": "return LIBC.mount(b'none', b'/tmp', b'tmpfs', 0, None) == 0",
    "bpf": "return LIBC.syscall(321, 5, ctypes.create_string_buffer(128), 128) >= 0",
    "keyctl of the session": "return LIBC.syscall(250, 11, -3, None, 0) > 0",
    "set the clock": "import time; time.clock_settime(0, 0); return True",
    "reboot": "return LIBC.reboot(0x89ABCDEF) == 0",
    "limits raised": (
        "import resource; resource.setrlimit(resource.RLIMIT_DATA, (-1, -1)); return True"
    ),
    "another user": "os.setuid(4242); return True",
    "a device made": "os.mknod('/tmp/disk', 0o60666, os.makedev(8, 0)); return open('/tmp/disk')",
    "10 GB": "return bytearray(10**10)",
    "10 GB in pieces": "return [bytearray(10**8) for _ in range(100)]",
    "6 GB of shared mapping": "import mmap; return mmap.mmap(-1, 6 * 10**9)",
    "3 GB of memfd": (
        "fd = os.memfd_create('m')\nfor _ in range(30): os.write(fd, bytes(10**8))\nreturn True"
    ),
    "1000 files": "return [open(os.devnull) for _ in range(1000)]",
    "fills the disk": (
        "f = open('/tmp/full', 'wb')\n"
        "for _ in range(100): f.write(bytes(10**6)); f.flush()\n"
        "return True"
    ),
    "1000 threads": (  # last: they need the memory of the others
        "from threading import Thread\n"
        "for _ in range(1000): Thread(target=time.sleep, args=(5,), daemon=True).start()\n"
        "return True"
    ),
}

# What it may do in a world of its own, of which nothing is left when it ends.
LEFT_BEHIND: dict[str, str] = {
    "fork": "if os.fork() == 0: time.sleep(600)",
    "daemon (setsid, two forks)": (
        "if os.fork() == 0:\n"
        "    os.setsid()\n"
        "    if os.fork() == 0: time.sleep(600)\n"
        "    os._exit(0)"
    ),
    "clone with CLONE_PARENT": "if LIBC.syscall(56, 0x8000 | 17, 0, 0, 0, 0) == 0: time.sleep(600)",
    "fork bomb": (
        "for _ in range(100):\n    if os.fork() == 0:\n        os.setsid(); time.sleep(600)"
    ),
    "double fork that ignores signals": (
        "if os.fork() == 0:\n"
        "    for n in range(1, 65):\n"
        "        try: signal.signal(n, signal.SIG_IGN)\n"
        "        except (OSError, ValueError): pass\n"
        "    os.setsid(); time.sleep(600)"
    ),
}

# Ends its process, or writes what it likes where its answers go; what is said of it.
FORGED: dict[str, tuple[str, str]] = {
    "answers before the question": ("WRITE(b'[]\\n')", "channel"),
    "no id": ('WRITE(b\'{"functions": {}, "versions": {}}\\n\')', "channel"),
    "an id of its own": ('WRITE(b\'{"id": "0", "done": []}\\n\')', "channel"),
    "half an answer, then nothing": ("WRITE(b'{\"id\"'); os._exit(0)", "ended its own process"),
    "deep JSON": ("WRITE(b'[' * 10**5 + b'\\n')", "channel"),
    "a huge integer": ("WRITE(b'1' * 10**5 + b'\\n')", "channel"),
    "not text": ("WRITE(bytes(range(128, 256)) + b'\\n')", "channel"),
    "closes all handles": ("os.closerange(0, 99)", "ended its own process"),
    "os._exit(0)": ("os._exit(0)", "ended its own process (exit status 0)"),
    "os.abort": ("os.abort()", "SIGABRT"),
    "segmentation fault": ("ctypes.string_at(0)", "SIGSEGV"),
    "kills itself": ("os.kill(os.getpid(), 9)", "SIGKILL"),
    "SystemExit": ("raise SystemExit(3)", "SystemExit"),
    "recursion": ("f = lambda: f(); f()", "calls itself without end"),
    "an exception whose str raises": (
        "class E(Exception):\n    def __str__(self): raise ValueError\nraise E",
        "",
    ),
    "escapes in an exception": ("raise ValueError('\\x1b]0;x\\x07')", "\\x1b]0;x\\x07"),
}
