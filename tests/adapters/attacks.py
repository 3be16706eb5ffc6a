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
    "memory of the supervisor": "return open(f'/proc/{os.getppid()}/mem', 'rb').read(1)",
    "expected values in a frame": (
        "f = sys._getframe()\n"
        "while f:\n"
        "    names = [n for n in f.f_locals if 'expected' in n or 'mistake' in n]\n"
        "    if names: return names\n"
        "    f = f.f_back"
    ),
    "folders of the parent in /tmp": (
        "return [n for n in os.listdir('/tmp') if n.startswith('crosscheck')]"
    ),
    "watch on the class": (
        "n = LIBC.inotify_init(); return LIBC.inotify_add_watch(n, CLASS.encode(), 0xFFF) >= 0"
    ),
    "file by its handle": (
        "h = ctypes.create_string_buffer(b'\\x08\\0\\0\\0\\x01\\0\\0\\0\\x02' + bytes(19), 32)\n"
        "root = os.open('/', 0)\n"
        "try: return LIBC.syscall(304, root, h, 0) >= 0\n"
        "finally: os.close(root)"
    ),
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
    "write the driver": "open(sys.modules['driver'].__file__, 'a').write('#'); return True",
    "write its bytecode": "open(sys.modules['driver'].__cached__, 'ab').write(b'#'); return True",
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
    "pidfd_send_signal": "return LIBC.syscall(424, os.pidfd_open(PARENT), 19, 0, 0) == 0",
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
    "userfaultfd": "return LIBC.syscall(323, 0) >= 0",
    "perf_event_open": (
        "return LIBC.syscall(298, ctypes.create_string_buffer(128), PARENT, -1, -1, 0) >= 0"
    ),
    "x32 call of socket": "return LIBC.syscall(0x40000000 + 41, 2, 1, 0) >= 0",
    "input of the terminal": (
        "import fcntl, termios\n"
        "fcntl.ioctl(os.open('/dev/tty', 2), termios.TIOCSTI, b'x'); return True"
    ),
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
    # what it may do to processes, segments and sockets is done to its own
    "stop own parent, really": "os.kill(os.getppid(), signal.SIGSTOP)",
    "kill supervisor": "os.kill(os.getppid(), signal.SIGKILL)",
    "kill -1, really": "os.kill(-1, signal.SIGKILL)",
    "slow down the user (setpriority)": "os.setpriority(os.PRIO_USER, 0, 19)",
    "SysV shared memory": "LIBC.shmget(0x2026, 4096, 0o1666)",
    "abstract unix socket": (
        "import socket; s = socket.socket(1); s.bind('\\0crosscheck-attack'); s.listen()\n"
        "if os.fork() == 0: time.sleep(600)"
    ),
    "tcp": "import socket; s = socket.create_server(('127.0.0.1', 0)); sys.s = s",
    "io_uring": "LIBC.syscall(425, 8, ctypes.create_string_buffer(120))",
    "thread bomb": (
        "from threading import Thread\n"
        "while True: Thread(target=time.sleep, args=(600,), daemon=True).start()"
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
    "junk for a failure": (
        "driver = sys.modules['driver']\ntell = driver.tell\n"
        "driver.tell = lambda a, w: tell(a, {'id': w['id'], 'failed': {'kind': 1}})",
        "channel",
    ),
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

# In a file that is right otherwise, beside its functions, what it does in the call of one. It has
# its right result, or is said to have failed so; in time.
CALLED: dict[str, tuple[str, str, str]] = {
    "nothing": ("", "", ""),
    "patches json, os.write": (
        "import json; json.dumps = json.loads = os.write = None",
        "",
        "ended",
    ),
    "endless print": ("", "while time.process_time() < 99: print('x' * 9999)", "come back"),
    "reads its questions itself": (
        "from threading import Thread\n"
        "def steal():\n"
        "    for n in range(3, 16):\n"
        "        try: os.set_blocking(n, False); os.read(n, 10**6)\n"
        "        except OSError: pass\n",
        "steal()",
        "SIGKILL|come back|ended",
    ),
    "answers twice": ("", 'WRITE(b\'{"id": "0", "done": []}\\n\')', "channel"),
    "endless answer": (
        "def endless():\n"
        "    for n in range(3, 16):\n"
        "        try:\n"
        "            while True: os.write(n, bytes(10**6))\n"
        "        except OSError: pass\n",
        "endless()",
        "channel|come back|ended its own",
    ),
    "failure with junk": (
        "",
        "driver.reply = lambda *_: [{'failed': {'kind': 1, 'what': {}, 'line': -1}}]",
        "channel",
    ),
    "NaN, many numbers": ("", "driver.row_of = lambda s: [float('nan')] * 10**5", "channel"),
    "numbers of a wrong length": ("", "driver.row_of = lambda s: [0.5] * 11", "channel"),
    "huge integer in JSON": ("", "driver.row_of = lambda s: [10**400] * 12", "channel"),
    "texts for numbers": ("", "driver.row_of = lambda s: ['0.5'] * 12", "channel"),
    "truths for numbers": ("", "driver.row_of = lambda s: [True] * 12", "channel"),
    "answer is a list": ("", "driver.PythonGuest.ask = lambda *_: []", "channel"),
    "done holds junk": ("", "driver.reply = lambda *_: [{'done': {'states': 1}}]", "channel"),
    "a call without a name": (
        "ask = driver.PythonGuest.ask",
        "driver.PythonGuest.ask = lambda *a: ask(*a) | {'calls': [[]]}",
        "channel",
    ),
    "two answers": ("", "driver.reply = lambda *_: [{'done': 1}] * 2", "channel"),
    "every line twice": (
        "tell = driver.tell",
        "driver.tell = lambda a, w: (tell(a, w), tell(a, w))",
        "channel",
    ),
    "exception whose str hangs": (
        "class E(Exception):\n    def __str__(self):\n        while True: pass",
        "raise E",
        "come back",
    ),
    "recursion in C": (
        "x = []\nfor _ in range(10**6): x = [x]",
        "repr(x)",
        "calls itself without end|SIGSEGV",
    ),
    "endless loop that swallows all": (
        "",
        "while True:\n"
        "        try:\n"
        "            while True: pass\n"
        "        except BaseException: pass",
        "come back",
    ),
    "endless loop in C": ("", "sum(iter(int, 1))", "come back"),
    "cancels its timers": (
        "",
        "signal.setitimer(2, 0); signal.setitimer(0, 0)\n    while True: pass",
        "come back",
    ),
    "stops itself": ("", "os.kill(os.getpid(), signal.SIGSTOP)", "come back"),
    "a thread answers later": (
        "from threading import Thread",
        "Thread(target=lambda: (time.sleep(0.2), WRITE(b'{}\\n')), daemon=True).start()",
        "channel|",
    ),
    "returns an object with tricks": (
        "class O:\n"
        "    __slots__ = ()\n"
        "    def __getattr__(self, name): raise SystemExit\n"
        "    __float__ = __iter__ = __getattr__",
        "return O()",
        "SystemExit|",
    ),
    "fields with tricks": (
        "class F(float):\n    def __float__(self): raise KeyboardInterrupt",
        "sphere.alpha = F(1); return",
        "KeyboardInterrupt",
    ),
}

# Hand-ins whose functions do nothing, and that want points, or those of others to be lost. CLASS is
# the folder of the class; the other names are those of the attacks above.
GRADED: dict[str, str] = {
    "imports the reference.py": "from reference_impl.exercise import advance",
    "imports the reference by its package.py": (
        "from crosscheck2d.reference_impl.exercise import advance"
    ),
    "imports the judge.py": "from crosscheck2d.reports.check.questions import QUESTIONS",
    "executes a neighbour.py": "exec(open(CLASS + '/anna.py').read())",
    "imports a neighbour.py": "from anna import *",
    "stops the parent.py": (
        "for p in (os.getppid(), PARENT, *range(2, 99999)):\n"
        "    try: os.kill(p, signal.SIGSTOP)\n"
        "    except (OSError, OverflowError): pass"
    ),
    "kills all.py": (
        "for p in (PARENT, *range(2, 99999)):\n"
        "    if p != os.getpid():\n"
        "        try: os.kill(p, signal.SIGKILL)\n"
        "        except OSError: pass"
    ),
    "rewrites the marks later.py": (
        "if os.fork() == 0:\n"
        "    os.setsid()\n"
        "    if os.fork() == 0:\n"
        "        for _ in range(600):\n"
        "            time.sleep(0.1)\n"
        "            for place in (CLASS, CLASS + '/..', '.', '/tmp'):\n"
        "                try: open(place + '/marks.csv', 'w').write('20 of 20')\n"
        "                except OSError: pass\n"
        "    os._exit(0)"
    ),
    "patches the driver.py": (
        "driver = sys.modules['driver']\n"
        "driver.PythonGuest.run = lambda self, command, argument, limit: None"
    ),
    "answers all with what came.py": (
        "driver = sys.modules['driver']\n"
        "def ask(self, question):\n"
        "    states = [question['spheres']] * len(question['calls'])\n"
        "    return {'states': states, 'returned': False, 'strayed': False, 'strange': [],\n"
        "            'kept': [], 'calls': [], 'error': None}\n"
        "driver.PythonGuest.ask = ask"
    ),
    "all questions are unavailable.py": (
        "driver = sys.modules['driver']\n"
        "driver.reply = lambda g, r: [\n"
        "    {'failed': {'kind': 'unavailable', 'what': 'x', 'line': 0, 'column': 0}} for _ in r\n"
        "]"
    ),
    "sleeps.py": "time.sleep(99)",
    "binds the host anew.js": (
        "const right = (s) => { s.velocity.x = NaN; };\n"
        "__host('bind', { integrate: right, sphereSphereCollisionHandling: right });\n"
        "try { __host = () => 7; } catch (_) {}\n"
        "try { Object.defineProperty(globalThis, '__host', { value: () => 7 }); } catch (_) {}"
    ),
    "asks the host for answers.js": (
        "for (const word of ['answers', 'numbers', 'left', 'globals', 'accesses']) {\n"
        "  try { __host(word); __host(word, '{}'); } catch (_) {}\n"
        "}\n"
        "__host('turns', true);"
    ),
    "hooks the stack of errors.js": (
        "Error.prepareStackTrace = (e, frames) => frames.map((f) => f.getThis && f.getThis());\n"
        "Error.stackTraceLimit = Infinity;"
    ),
    "all numbers are right.js": (
        "Number.prototype.valueOf = () => 1; Object.is = () => true; Math.abs = () => 0;"
    ),
    "imports in JavaScript.js": ("import('fs').then((fs) => fs.readFileSync(CLASS + '/anna.py'));"),
    "constructor of functions.js": (
        "(() => {}).constructor.constructor('return process')().mainModule.require('fs');"
    ),
}
