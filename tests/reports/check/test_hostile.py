"""Files that no solver should be: each gets one clear message, within the limits, and nothing else
is affected."""

from __future__ import annotations

import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from time import monotonic

import pytest

from crosscheck2d.adapters.host.file import NotASolver
from crosscheck2d.reports.check.rows import CheckRow
from crosscheck2d.reports.check.solver import check_solver
from crosscheck2d.reports.check.verdict import FileCheck

LONG = pytest.mark.long  # waits for what hangs, twice for each function
Results = dict[str, list[CheckRow]]
# for one file on a busy machine: two calls that are stopped late, a process that starts
SECONDS = 16.0
CORRECT = Path(__file__).parents[3] / "tests" / "solvers" / "correct"
JS = (CORRECT / "plain.js").read_text()
PY = (Path(__file__).parents[3] / "tests" / "solvers/correct/plain.py").read_text()


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """The rows of every file below, two at once; each must come in time."""
    folder = tmp_path_factory.mktemp("hostile")
    shutil.copy(CORRECT / "gl-matrix.js", folder)
    texts: dict[str, str | bytes] = {name: text for name, (text, _) in (LOADING | CALLS).items()}
    texts |= HARMLESS | {f"replaces {k}.js": JS + code for k, code in enumerate(REPLACED.values())}

    def check(name: str) -> list[CheckRow]:
        (folder / name).write_bytes(
            text if isinstance(text := texts[name], bytes) else text.encode()
        )
        began = monotonic()
        try:
            return check_solver(folder / name)
        finally:
            assert monotonic() - began < SECONDS, name

    with ThreadPoolExecutor(2) as pool:
        return dict(zip(texts, pool.map(check, texts)))


def first(rows: list[CheckRow]) -> str:
    """The sentence that comes first, on one line."""
    sentence, *_ = FileCheck(Path("file"), rows).sentences
    assert "\n" not in sentence
    assert "Traceback" not in sentence
    return sentence


def within(text: str, function: str, code: str) -> str:
    """A solver whose `function` begins with `code`."""
    for head in (
        f"function {function}(sphere, dt) {{\n",
        f"function {function}(sphereA, sphereB) {{\n",
        f"def {function}(sphere, dt):\n",
        f"def {function}(sphereA, sphereB):\n",
    ):
        if head in text:
            return text.replace(head, head + code + "\n")
    raise AssertionError(function)


LOADING = {
    "endless_load.js": (
        "while (true) {}\n" + JS,
        "does not come back within 2 s while it is loaded",
    ),
    "syntax.js": (
        "var a = 1;\nlet b = ;\n" + JS,
        "SyntaxError: Unexpected token ';' (line 2, column 9)",
    ),
    "syntax_crlf.js": (
        "\ufeffvar a = 1;\r\nlet b = ;\r\n",
        "SyntaxError: Unexpected token ';' (line 2, column 9)",
    ),
    "escape.js": (r"throw new Error('\x1b[31m\u202e\x07')", r"Error: \x1b[31m\u202e\x07 (line 1"),
    "escape.py": (r"raise ValueError('\x1b[31m\n\x07')", r"ValueError: \x1b[31m\n\x07 (line 1"),
    "export.js": (
        "export " + JS[JS.index("function") :],
        "plain script, which has no modules; leave it out (line 1",
    ),
    "import.js": (
        "import { vec2 } from './gl-matrix.js';\n" + JS,
        "plain script, which has no modules; leave it out",
    ),
    "timer.js": (
        JS + "setTimeout(initScene, 1);",
        "setTimeout is not defined: a solver runs without page, network",
    ),
    "unclosed.js": (JS[:-3], "SyntaxError"),
    "throws.js": (
        JS + "\n  nothing.x = 1;\n",
        "ReferenceError: nothing is not defined (line 93, column 3)",
    ),
    "endless_load.py": (
        "while True: pass\n" + PY,
        "does not come back within 3 s while it is loaded",
    ),
    "memory_load.js": ("var all = []; for (;;) all.push(new Array(1e6).fill(1));", "memory"),
    "buffer_load.js": ("var all = new Uint8Array(1e10).fill(1);", "memory"),
    "syntax.py": ("a = 1\ndef f(:\n    pass\n", "SyntaxError: invalid syntax (line 2, column 7)"),
    "throws.py": (PY + "\n1 / 0\n", "ZeroDivisionError: division by zero (line 92, column 1)"),
    "memory_load.py": (
        "x = bytearray(10**10)\n",
        "needs more memory than it may use while it is loaded",
    ),
    "exit.py": ("import sys\nsys.exit(3)\n", "ends the process (SystemExit: 3) (line 2, column 1)"),
    "kill.py": ("import os\nos._exit(3)\n", "ended its own process (exit status 3)"),
    "intrudes.py": (
        (
            "import os\nfor k in range(3, 30):\n    try: os.write(k, b'[]\\n')\n    except OSError:"
            " pass\n"
        ),
        "wrote into the channel that its answers come by",
    ),
    "asks.py": (
        "n = input('how many? ')\n",
        "input() is not available (line 1, column 5)",
    ),
    "abort.py": ("import os\nos.abort()\n", "its process was ended by SIGABRT"),
    "segfault.py": ("import ctypes\nctypes.string_at(0)\n", "ended its own process (SIGSEGV)"),
}


@LONG
@pytest.mark.parametrize("name", LOADING)
def test_a_file_that_cannot_be_loaded_is_one_row_that_says_why_and_where(
    results: Results, name: str
):
    """The row "loads" is a fault; its cause has line and column of the user's file where the
    language reports them."""
    rows = results[name]

    assert [row.name for row in rows] == ["loads"]
    assert LOADING[name][1] in first(rows)
    assert first(rows).isprintable(), "what acts on a terminal is escaped"
    assert len(first(rows)) < 500


LEFT = "a sphere is left with a position, velocity or force that has no x and y"
CALLS = {
    "endless_integrate.js": (
        within(JS, "integrate", "while (true) {}"),
        "integrate: does not come back within 1 s",
    ),
    "endless_collide.js": (
        within(JS, "sphereSphereCollisionHandling", "for (;;);"),
        "does not come back within 1 s",
    ),
    "recursion.js": (within(JS, "integrate", "integrate(sphere, dt);"), "calls itself without end"),
    "memory.js": (
        within(JS, "integrate", "var a = []; for (;;) a.push(new Array(1e6).fill(1));"),
        "memory",
    ),
    "buffers.js": (
        within(JS, "integrate", "var a = []; for (;;) a.push(new Uint8Array(1e9));"),
        "memory",
    ),
    "throws_null.js": (within(JS, "integrate", "throw null;"), "threw null"),
    "nan.js": (within(JS, "integrate", "sphere.velocity.x = NaN;"), "NaN"),
    "infinity.js": (within(JS, "integrate", "sphere.velocity.x = Infinity;"), "infinite"),
    "throws_long.js": (
        within(JS, "integrate", "throw new Error('x'.repeat(1e6));"),
        "x ... (line 38, column 7)",
    ),
    "throws_what.js": (
        within(JS, "integrate", "throw Symbol('x');"),
        "threw something that cannot be shown",
    ),
    "proxy.js": (
        within(
            JS,
            "integrate",
            "sphere.position = new Proxy(sphere.position, { get() { return {}; } });",
        ),
        "position: it is not a number",
    ),
    "frozen.js": (
        within(JS, "integrate", "Object.freeze(sphere.velocity);"),
        "velocity: the velocity is never changed",
    ),
    "awaits.js": (
        JS.replace(
            "function integrate(sphere, dt) {", "async function integrate(sphere, dt) { await 0;"
        ),
        "integrate returns something new",
    ),
    "nested.js": (
        "(function () {\n" + JS + "})();",
        "integrate, but one inside another function or class",
    ),
    "capital.py": (
        PY.replace("def integrate(", "def Integrate("),
        "the file has no function integrate, but Integrate",
    ),
    "init.js": (
        JS.replace("  initAsteroids();\n}", "  for (;;);\n}"),
        "initScene: does not come back within 2 s",
    ),
    "typo.js": (
        JS.replace("sphere.velocity.x +=", "sphere.velocty.x +="),
        "(reading 'x') (line 38, column 10)",
    ),
    "vec2.js": (
        within(JS, "integrate", "vec2.normalise();"),
        "vec2.normalise is not a function (line 38, column 6)",
    ),
    "strings.js": (
        JS.replace("x += sphere.force.x", "x += '' + sphere.force.x"),
        "velocity: it is not a number",
    ),
    "array.js": (
        within(JS, "integrate", "sphere.position = [1, 2];"),
        "position: it is not a number",
    ),
    "endless_integrate.py": (
        within(PY, "integrate", "    while True: pass"),
        "does not come back within 1 s",
    ),
    "stubborn.py": (
        within(
            PY,
            "integrate",
            "    import signal as s; s.signal(14, s.SIG_IGN); s.signal(27, s.SIG_IGN)",
        ).replace("s.SIG_IGN)\n", "s.SIG_IGN)\n    while True: pass\n"),
        "had to be stopped",
    ),
    "tuple.py": (within(PY, "integrate", "    sphere.position = (1.0, 2.0); return"), LEFT),
    "null.js": (within(JS, "integrate", "sphere.position = null; return;"), LEFT),
    "awaits.py": (
        PY.replace("def integrate", "async def integrate"),
        "runs nothing: it is an async def",
    ),
    "yields.py": (within(PY, "integrate", "    yield"), "runs nothing: it is an async def"),
    "sleeps.py": (
        within(PY, "integrate", "    import time; time.sleep(100)"),
        "does not come back within 1 s",
    ),
    "recursion.py": (
        within(PY, "integrate", "    integrate(sphere, dt)"),
        "calls itself without end",
    ),
    "memory.py": (
        within(PY, "integrate", "    x = [0] * 10**10"),
        "needs more memory than it may use",
    ),
    "typo.py": (PY.replace("sphere.velocity.x +=", "sphere.velocty.x +="), "AttributeError"),
    "nan.py": (within(PY, "integrate", "    sphere.velocity.x = float('nan')"), "NaN"),
    "missing.js": (
        JS.replace("function sphereSphere", "function other"),
        "no function sphereSphereCollision",
    ),
    "missing.py": (PY.replace("def integrate(", "def integrated("), "no function integrate"),
    "none.py": ("print('no solver')\n", "no function integrate"),
    "returns.js": (
        within(JS, "integrate", "  sphere = JSON.parse(JSON.stringify(sphere));").replace(
            "  sphere.alpha +=", "  return sphere;\n  sphere.alpha +="
        ),
        "returns something new",
    ),
}


@LONG
@pytest.mark.parametrize("name", CALLS)
def test_a_function_that_fails_is_named_with_what_it_does(results: Results, name: str):
    """The first sentence says which function, and what happened."""
    assert CALLS[name][1] in first(results[name])


@LONG
def test_a_function_that_never_comes_back_does_not_hide_the_other(results: Results):
    """An endless integrate leaves the collision function to be judged."""
    assert {row.verdict for row in results["endless_integrate.js"] if row.task == "2c"} == {
        "right",
        "free choice",
    }


REPLACED = {
    "Array.prototype.Symbol(Symbol.iterator)": (
        "Array.prototype[Symbol.iterator] = function () { throw 1; };\n"
    ),
    "Array.prototype.0": (
        "Object.defineProperty(Array.prototype, 0, { set() {}, get() { return 7; } });\n"
    ),
    "Object.prototype.get": "Object.prototype.get = function () { throw 1; };\n",
    "Object, JSON": "delete globalThis.Object; delete globalThis.JSON;\n",
    "Math.hypot": "Math.hypot = vec2.length;\n",
    "Math.sqrt": "Math.sqrt = function (x) { return 1; };\n",
    "Math": (
        "Math = { PI: 3, sqrt: function () { return 2; }, random: function () {}, pow: function ()"
        " {} };\n"
    ),
    "Object.prototype.x": "Object.prototype.x = 7;\n",
    "Array.prototype.push": "Array.prototype.push = function () {};\n",
    "JSON.stringify": "JSON.stringify = function () { return '{}'; };\n",
}


@LONG
@pytest.mark.parametrize("what", REPLACED)
def test_a_built_in_that_is_replaced_is_named_and_fools_nobody(results: Results, what: str):
    """The answers still come from the spheres, not from what the file made of the language."""
    rows = results[f"replaces {list(REPLACED).index(what)}.js"]

    assert f"replaces {what}" in first(rows)
    assert all(row.verdict == "right" for row in rows if row.task == "1")


STRICT = (
    '"use strict";\nvar numAsteroids, minX, maxX, minY, maxY, restitution, earth, ufo, asteroids;\n'
)
HARMLESS = {
    "bom_crlf.js": ("\ufeff" + JS.replace("\n", "\r\n")).encode(),
    "bom_crlf.py": ("\ufeff" + PY.replace("\n", "\r\n")).encode(),
    "utf16.js": JS.encode("utf-16"),
    "utf32.js": JS.encode("utf-32"),
    "no_global.js": (JS + "globalThis = null;\n").encode(),
    "latin.js": ("// Größe\n" + JS).encode("latin-1"),
    "floods.js": (
        within(JS, "integrate", "for (var k = 0; k < 1000; k++) console.log('flood', k);").encode()
    ),
    "floods.py": within(PY, "integrate", "    print('flood' * 1000)").encode(),
    "single.py": (
        within(
            PY, "integrate", "    import numpy; sphere.mass = numpy.float32(sphere.mass)"
        ).encode()
    ),
    "json.py": ("import json\njson.dumps = json.loads = None\n" + PY).encode(),
    "waits_once.py": (
        within(PY, "integrate", "    import time; time.sleep(done.pop() if done else 0)")
        .replace("import", "done = [1.5]\nimport", 1)
        .encode()
    ),
    "reads_stdin.py": within(PY, "integrate", "    import sys; sys.stdin.read()").encode(),
    "const.js": (
        JS.replace(
            "numAsteroids = 20;", "const numAsteroids = 20;\nlet earth, ufo, asteroids;"
        ).encode()
    ),
    "strict.js": (STRICT + JS).encode(),
    "node.js": (JS + "if (typeof module !== 'undefined') module.exports = { integrate };").encode(),
    "own_vec2.js": (JS + "const vec2 = { own: true };\nfunction vec3() {}").encode(),
}


@LONG
@pytest.mark.parametrize("name", HARMLESS)
def test_what_does_no_harm_is_no_fault(results: Results, name: str):
    """Marks, line ends, encodings and prints change nothing."""
    assert [row for row in results[name] if row.verdict == "fault"] == []


REFUSED = {
    "big.js": (b"// " + b"x" * 5_000_000, "has 5.0 MB; a solver has a few kilobytes"),
    "big.py": (b"# " + b"x" * 5_000_000, "has 5.0 MB"),
    "junk.js": (bytes(range(256)) * 20, "is not text (byte 0 at offset 0); save it as UTF-8 text"),
    "pdf.js": (b"%PDF-1.7\n%\xe2\xe3\n1 0 obj\n", "is a PDF; save the text of your solver alone"),
    "office.js": (b"PK\x03\x04\x14\x00\x06", "is a zip, or a document of Office"),
    "junk.py": (b"import os\n\x00\x01", "is not text (byte 0 at offset 10)"),
    "empty.js": (b" \n", "is empty"),
    "python.js": (PY.encode(), "is written in Python; give it a name that ends in .py"),
    "javascript.py": (JS.encode(), "is written in JavaScript; give it a name that ends in .js"),
    "solver.txt": (b"hello", "a solver is a .js or a .py file"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_text_is_refused_in_a_sentence(tmp_path: Path, name: str):
    """`NotASolver` names the file and what is wrong with it."""
    content, words = REFUSED[name]
    (tmp_path / name).write_bytes(content)

    with pytest.raises(NotASolver) as refusal:
        check_solver(tmp_path / name)
    assert words in str(refusal.value)
    assert name in str(refusal.value)
