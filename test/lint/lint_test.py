#!/usr/bin/env python3
"""The linter has to find what it promises: each case is a small tree with one mistake, and names the rule and the line. A case
with rule None is correct code that looks like a mistake and must pass. Run by ctest as lint_self_test."""

import io
import json
import sys
import tempfile
import unittest
import unittest.mock
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).resolve().parent))
import lint  # noqa: E402
import rules  # noqa: E402

# A tree without a finding; cases add or replace files.
CLEAN = {
    "cmake/options.cmake": "target_compile_options(rl_options INTERFACE -Wall -ffp-contract=off)\n",
    "protocols/can_frame.hpp": "#pragma once\n#include <cstdint>\n",
    "firmware/core/interface.hpp": "#pragma once\n#include <cstdint>\n",
    "host/base/error.hpp": "#pragma once\n#include <string>\n",
    "host/bus/can_bus.hpp": '#pragma once\n#include "protocols/can_frame.hpp"\nvoid send(int frame);\n',
    "host/vehicle/model.hpp": "#pragma once\n",
    "sim/world/bus.hpp": '#pragma once\n#include "host/bus/can_bus.hpp"\nvoid deliver();\n',
    "test/unit/sim/world/bus_test.cpp": '#include "sim/world/bus.hpp"\n#include "host/vehicle/model.hpp"\n',
}


def findings(files, compile_commands=()):
    tree = {**CLEAN, **files}
    for name in list(tree):
        if name.endswith((".hpp", ".cpp")):
            tree.setdefault(str(Path(name).parent / "README.md"), "# room\n")
    return lint.Linter({name: text for name, text in tree.items() if text is not None}).run(compile_commands)


EFFECT = '[[effect]]\nid = "wet_air"\nkind = "none"\nplant = true\n'
FUNCTION_61 = "void f(int i) {\n" + "  i;\n" * 59 + "}\n"
TEN_ROOMS = {f"{room}/{file}.hpp": "//\n" * 300
             for room in ("sim/drive", "sim/rotor", "sim/sensor", "sim/esc", "sim/plant", "host/node", "host/control", "host/estimate", "bench/sysid/log",
                          "bench/hil/flight") for file in "xy"}


def house():
    """The page for CLEAN: a row for each room on lines 3 to 8, below it a walk with its count on line 10 and hops on lines 11 and 12."""
    return ("| room | may include |\n|---|---|\n"
            "| `sim/world` | `host/base`, `host/bus`, `protocols` |\n| `protocols` |  |\n| `host/base` |  |\n"
            "| `host/bus` | `host/base`, `protocols` |\n| `host/vehicle` | `host/base` |\n| `firmware/core` | `protocols`, `firmware/board/board.hpp` |\n"
            "### Walk: a frame\nCalls between files: 1 of 4. Rooms entered twice: none.\n"
            "1. `sim/world/bus.hpp: deliver` at its end.\n2. `host/bus/can_bus.hpp: send` to all.\n")


# (name, {file: text}, rule or None, file:line of the finding)
CASES = [
    # (h) one name, one type
    ("two headers define one type", {"host/vehicle/a.hpp": "namespace rotorloop::host {\nstruct Row {\n};\n}\n",
                                     "host/vehicle/b.hpp": "namespace rotorloop::host {\n\nclass Row final : public Base {\n};\n}\n"},
     "type-name", "host/vehicle/b.hpp:3"),
    ("one name in two namespaces", {"host/vehicle/a.hpp": "namespace rotorloop::host {\nstruct Row {\n};\n}\n",
                                    "sim/world/b.hpp": "namespace rotorloop::sim {\nstruct Row {\n};\n}\n"}, None, None),
    ("a class inside another, defined apart", {"host/vehicle/a.hpp": "namespace rotorloop::host {\nclass Bus {\n};\n}\n",
                                               "host/vehicle/b.hpp": "namespace rotorloop::host {\nclass Bus::Port final : public Base {\n};\n}\n"}, None, None),
    ("a type told of before it is defined", {"host/vehicle/a.hpp": "namespace rotorloop::host {\nstruct Row {\n};\n}\n",
                                             "host/vehicle/b.hpp": "namespace rotorloop::host {\nstruct Row;\n}\n"}, None, None),
    # (a) arrows
    ("plant includes the vehicle model", {"sim/world/x.cpp": '\n#include "host/vehicle/model.hpp"\n'}, "include-arrow", "sim/world/x.cpp:2"),
    ("host includes sim", {"host/bus/x.cpp": '#include "sim/world/bus.hpp"\n'}, "include-arrow", "host/bus/x.cpp:1"),
    ("host includes bench", {"host/vehicle/x.cpp": '#include "bench/hil/flight/r.hpp"\n', "bench/hil/flight/r.hpp": ""}, "include-arrow", "host/vehicle/x.cpp:1"),
    ("the command may include bench", {"cli/x.cpp": '#include "bench/hil/flight/r.hpp"\n', "bench/hil/flight/r.hpp": ""}, None, None),
    ("protocols includes firmware", {"protocols/x.hpp": '#include "firmware/core/interface.hpp"\n'}, "include-arrow", "protocols/x.hpp:1"),
    ("firmware includes host", {"firmware/core/x.cpp": '#include "host/base/error.hpp"\n'}, "include-arrow", "firmware/core/x.cpp:1"),
    ("firmware core includes a board", {"firmware/core/x.hpp": '#include "firmware/board/g431/pwm.hpp"\n', "firmware/board/g431/pwm.hpp": ""},
     "include-arrow", "firmware/core/x.hpp:1"),
    ("firmware core includes the board concept", {"firmware/core/x.hpp": '#include "firmware/board/board.hpp"\n', "firmware/board/board.hpp": ""}, None, None),
    ("vehicle includes control", {"host/vehicle/x.cpp": '#include "host/control/c.hpp"\n', "host/control/c.hpp": ""}, "include-arrow", "host/vehicle/x.cpp:1"),
    ("control includes vehicle", {"host/control/x.cpp": '#include "host/vehicle/model.hpp"\n'}, None, None),
    ("control sees samples of estimate only", {"host/control/x.cpp": '#include "host/estimate/estimator.hpp"\n', "host/estimate/estimator.hpp": ""},
     "include-arrow", "host/control/x.cpp:1"),
    ("render includes hil", {"bench/render/x.cpp": '#include "bench/hil/flight/r.hpp"\n', "bench/hil/flight/r.hpp": ""}, "include-arrow", "bench/render/x.cpp:1"),
    ("hil includes render", {"bench/hil/flight/x.cpp": '#include "bench/render/r.hpp"\n', "bench/render/r.hpp": ""}, None, None),
    ("product includes a test", {"sim/world/x.cpp": '#include "test/unit/fake.hpp"\n', "test/unit/fake.hpp": ""}, "include-arrow", "sim/world/x.cpp:1"),
    ("a room without a row", {"gadgets/x.cpp": "int x;\n"}, "include-arrow", "gadgets/x.cpp:1"),
    ("a commented include is none", {"sim/world/x.cpp": '// #include "host/vehicle/model.hpp"\n/*\n#include "host/vehicle/model.hpp"\n*/\n'}, None, None),
    ("include relative to the folder", {"sim/world/x.cpp": '#include "bus.hpp"\n'}, "include-path", "sim/world/x.cpp:1"),
    ("include upwards by dots", {"sim/world/x.cpp": '#include "../../host/vehicle/model.hpp"\n'}, "include-path", "sim/world/x.cpp:1"),
    ("the generated version header", {"cli/x.cpp": '#include "rotorloop_version.hpp"\n'}, None, None),
    # (b) code for targets
    ("heap header in firmware", {"firmware/core/x.hpp": "#include <vector>\n"}, "target-header", "firmware/core/x.hpp:1"),
    ("stdio in protocols", {"protocols/x.cpp": "\n\n#include <cstdio>\n"}, "target-header", "protocols/x.cpp:3"),
    ("allowed headers", {"firmware/core/x.hpp": "#include <array>\n#include <span>\n#include <cmath>\n"}, None, None),
    ("new in firmware", {"firmware/core/x.cpp": "int* p = new int;\n"}, "target-new", "firmware/core/x.cpp:1"),
    ("new in a comment or a name", {"firmware/core/x.cpp": "// a new frame\nint new_frame = 0;\n"}, None, None),
    ("throw in protocols", {"protocols/x.cpp": "void f() {\n  throw 1;\n}\n"}, "target-throw", "protocols/x.cpp:2"),
    ("virtual in firmware", {"firmware/core/x.hpp": "struct A { virtual void f(); };\n"}, "target-virtual", "firmware/core/x.hpp:1"),
    ("virtual in host is fine", {"host/bus/x.hpp": "struct A { virtual void f(); };\n"}, None, None),
    ("dynamic_cast in firmware", {"firmware/core/x.cpp": "auto p = dynamic_cast<A*>(q);\n"}, "target-rtti", "firmware/core/x.cpp:1"),
    ("std::string in protocols", {"protocols/x.cpp": "std::string s;\n"}, "target-string", "protocols/x.cpp:1"),
    ("double in firmware", {"firmware/core/x.cpp": "float a;\ndouble b;\n"}, "target-double", "firmware/core/x.cpp:2"),
    ("double in protocols", {"protocols/x.cpp": "double b;\n"}, "target-double", "protocols/x.cpp:1"),
    ("double on the board", {"firmware/board/g431/x.cpp": "double b;\n"}, None, None),
    # (c) clocks and random numbers
    ("steady clock in sim", {"sim/world/x.cpp": "auto t = std::chrono::steady_clock::now();\n"}, "wall-clock", "sim/world/x.cpp:1"),
    ("clock_gettime in host/control", {"host/control/x.cpp": "clock_gettime(CLOCK_MONOTONIC, &ts);\n"}, "wall-clock", "host/control/x.cpp:1"),
    ("gettimeofday in firmware", {"firmware/core/x.cpp": "gettimeofday(&t, nullptr);\n"}, "wall-clock", "firmware/core/x.cpp:1"),
    ("time(nullptr) in host/vehicle", {"host/vehicle/x.cpp": "long t = time(nullptr);\n"}, "wall-clock", "host/vehicle/x.cpp:1"),
    ("std::time in host/estimate", {"host/estimate/x.cpp": "long t = std::time(nullptr);\n"}, "wall-clock", "host/estimate/x.cpp:1"),
    ("waiting in sim", {"sim/world/x.cpp": "std::this_thread::sleep_for(d);\n"}, "wall-clock", "sim/world/x.cpp:1"),
    ("system clock in bench outside the listed file", {"bench/hil/flight/x.cpp": "auto t = std::chrono::system_clock::now();\n"}, "wall-clock", "bench/hil/flight/x.cpp:1"),
    ("clock in the listed file", {"bench/hil/flight/cost_meter.hpp": "auto t = std::chrono::steady_clock::now();\n"}, None, None),
    ("a backend of host/bus may read the clock", {"host/bus/x.cpp": "auto t = std::chrono::steady_clock::now();\n"}, None, None),
    ("a member called time", {"sim/world/x.cpp": "double t = frame.time(0);\n"}, None, None),
    ("mt19937 in sim", {"sim/world/x.cpp": "std::mt19937_64 g;\n"}, "std-random", "sim/world/x.cpp:1"),
    ("a distribution in bench", {"bench/hil/flight/x.cpp": "std::normal_distribution<double> d;\n"}, "std-random", "bench/hil/flight/x.cpp:1"),
    ("random_device in host/control", {"host/control/x.cpp": "std::random_device r;\n"}, "std-random", "host/control/x.cpp:1"),
    ("rand in sim", {"sim/world/x.cpp": "int i = rand();\n"}, "std-random", "sim/world/x.cpp:1"),
    # (d) libm
    ("std::sin in sim", {"sim/rotor/x.cpp": "double y = std::sin(x);\n"}, "libm", "sim/rotor/x.cpp:1"),
    ("bare exp in host/control", {"host/control/x.cpp": "double y = exp(x);\n"}, "libm", "host/control/x.cpp:1"),
    ("atan2f in firmware", {"firmware/core/x.cpp": "float y = atan2f(a, b);\n"}, "libm", "firmware/core/x.cpp:1"),
    ("pow in host/estimate", {"host/estimate/x.cpp": "double y = std::pow(x, 2.0);\n"}, "libm", "host/estimate/x.cpp:1"),
    ("hypot in host/vehicle", {"host/vehicle/x.cpp": "double y = std::hypot(x, 2.0);\n"}, "libm", "host/vehicle/x.cpp:1"),
    ("libm in bench is fine", {"bench/hil/flight/x.cpp": "double y = std::sin(x);\n"}, None, None),
    ("own functions, members, exact functions", {"sim/rotor/x.cpp": "double y = sin_exact(x) + std::sqrt(x) + std::fabs(x) + m.log(x) + p->exp(x);\n"}, None, None),
    ("Eigen's AngleAxis in sim", {"sim/world/x.cpp": "Eigen::AngleAxisd a(x, v);\n"}, "libm", "sim/world/x.cpp:1"),
    # (e) floating point as written
    ("options without -ffp-contract=off", {"cmake/options.cmake": "# -ffp-contract=off\n"}, "float-option", "cmake/options.cmake:1"),
    ("fast math in a target", {"sim/CMakeLists.txt": "\ntarget_compile_options(x PRIVATE -ffast-math)\n"}, "float-option", "sim/CMakeLists.txt:2"),
    ("march in a preset", {"CMakePresets.json": '{\n"flags": "-O2 -march=native"\n}\n'}, "float-option", "CMakePresets.json:2"),
    ("march in a script", {"scripts/bench": "g++ -march=native x.cpp\n"}, "float-option", "scripts/bench:1"),
    ("contraction switched on again", {"sim/CMakeLists.txt": "add_compile_options(-ffp-contract=fast)\n"}, "float-option", "sim/CMakeLists.txt:1"),
    ("a comment about fast math", {"sim/CMakeLists.txt": "# never -ffast-math\n"}, None, None),
    ("optimize pragma", {"sim/world/x.cpp": '#pragma GCC optimize ("fast-math")\n'}, "float-pragma", "sim/world/x.cpp:1"),
    # (f) heap in the loop
    ("std::vector in host/control", {"host/control/x.cpp": "std::vector<double> v;\n"}, "loop-heap", "host/control/x.cpp:1"),
    ("std::string in host/estimate", {"host/estimate/x.hpp": "std::string s;\n"}, "loop-heap", "host/estimate/x.hpp:1"),
    ("string_view in host/control", {"host/control/x.cpp": "std::string_view s;\n"}, None, None),
    ("set-up file of host/control", {"host/control/trajectory_file.cpp": "std::vector<double> v;\n"}, None, None),
    ("an exemption that suppresses nothing", {"host/control/trajectory_file.cpp": "int i;\n"}, "exemption-not-needed", "host/control/trajectory_file.cpp:1"),
    # (g) folders and files
    ("folder without README", {"host/node/x.cpp": "int i;\n", "host/node/README.md": None}, "folder-readme", "host/node/README.md:1"),
    ("401 lines", {"sim/world/x.cpp": "int i;\n" * 401}, "file-length", "sim/world/x.cpp:401"),
    ("400 lines", {"sim/world/x.cpp": "//\n" * 400}, None, None),
    ("a test of 601 lines", {"test/unit/x_test.cpp": "int i;\n" * 601}, "file-length", "test/unit/x_test.cpp:601"),
    ("a test of 600 lines", {"test/unit/x_test.cpp": "//\n" * 600}, None, None),
    ("statements joined by a comma", {"sim/world/x.cpp": "void f() {\n  g();\n  a.x = 1, b->y[2] += h(3, 4);\n}\n"}, "joined-statements", "sim/world/x.cpp:3"),
    ("joined behind a condition", {"sim/world/x.cpp": "void f() {\n  if (a)\n    x = 1, ++n;\n}\n"}, "joined-statements", "sim/world/x.cpp:3"),
    ("joined behind a label, in a lambda", {"sim/world/x.cpp": "auto f = [](int i) {\n  switch (i) {\n    case 1: p.push_back(1), q = 2; break;\n  }\n};\n"},
     "joined-statements", "sim/world/x.cpp:3"),
    ("commas that join no statements", {"sim/world/x.cpp": "A::A() : a(1), b{2} {}\nvoid f(int i, int j) {\n  double x = 1.0, y = 2.0;\n  B &r = b, *p = &r;\n"
                                        "  auto [u, v] = g(i, j);\n  std::map<int, int> m = {{1, 2}, {3, 4}};\n  alignas(64) std::array<int, kMost> k{};\n  s.template store<4, How::by_name>(x, y);\n"
                                        "  matrix << 1, 2, 3;\n  for (i = 0, j = 1; i < 3; ++i, ++j) g(i, j);\n  return h<int, 2>(x), y;\n}\n"
                                        "enum E { one = 1, two = 2 };\nDECLARE(X)\nHandler g, h;\nstruct P {\n  P(int i, int j) : i_(i), j_(j) {}\n  ~P();\n};\n"}, None, None),
    ("a function of 61 lines", {"sim/world/x.cpp": "int i;\n" + FUNCTION_61}, "function-length", "sim/world/x.cpp:2"),
    ("a function of 60 lines", {"sim/world/x.cpp": FUNCTION_61.replace("  i;\n", "", 1)}, None, None),
    ("a member of 61 lines in a header", {"sim/world/x.hpp": "template <class T>\nstruct A final : B<T> {\n" + FUNCTION_61 + "};\n"},
     "function-length", "sim/world/x.hpp:3"),
    ("a lambda counts with its function", {"sim/world/x.cpp": "void f() {\n  const auto g = [&](int i) {\n" + "    i;\n" * 57 + "  };\n}\n"},
     "function-length", "sim/world/x.cpp:1"),
    ("a lambda that stands alone", {"sim/world/x.cpp": "const A kA[] = {{1, [](int i) -> int {\n" + "  i;\n" * 60 + "}}};\n"}, "function-length",
     "sim/world/x.cpp:1"),
    ("a constructor's list of members", {"sim/world/x.cpp": "A::A(int a)\n    : a_{a},\n      b_(a) {\n" + "  i;\n" * 58 + "}\n"}, "function-length",
     "sim/world/x.cpp:1"),
    ("braces in a default argument", {"sim/world/x.cpp": "void f(const A& a = {}, const std::function<void(int)>& b = {}) {\n" + "  i;\n" * 60 + "}\n"},
     "function-length", "sim/world/x.cpp:1"),
    ("neither a class, a table nor a concept is a function",
     {"sim/world/x.hpp": "struct alignas(16) A {\n" + "  int i;\n" * 70 + "};\nconstexpr B kB[] = {\n" + "    {1},\n" * 70 + "};\n"
                         "template <class T>\nconcept C = requires(T t) {\n" + "  t;\n" * 70 + "};\n"}, None, None),
    ("braces in comments, strings and characters", {"sim/world/x.cpp": "void f() {\n  // {\n  g(\"{\", '{', R\"({)\");\n}\n" + "int i;\n" * 70}, None, None),
    ("a script of 401 lines", {"scripts/x.py": "pass\n" * 401}, "file-length", "scripts/x.py:401"),
    # (h) words
    ("home folder in a document", {"docs/a.md": "one\nsee /ho" "me/me/data\n"}, "machine-path", "docs/a.md:2"),
    ("work folder in a comment", {"sim/world/x.cpp": "// from /wo" "rk/main\n"}, "machine-path", "sim/world/x.cpp:1"),
    ("root folder in a script", {"scripts/x": "cd /ro" "ot/x\n"}, "machine-path", "scripts/x:1"),
    ("a path below another", {"docs/a.md": "build/work/x and ./home/x and https://example.org/home/x\n"}, None, None),
    ("unfinished work", {"sim/world/x.cpp": "int i;  // TO" "DO: later\n"}, "unfinished", "sim/world/x.cpp:1"),
    ("fix me in a script", {"scripts/x.py": "# FIX" "ME\n"}, "unfinished", "scripts/x.py:1"),
    # Loops of modules: a header with its source file
    ("a header and another's source include each other", {"sim/world/a.hpp": '#include "sim/world/b.hpp"\n', "sim/world/b.hpp": "",
                                                          "sim/world/b.cpp": 'int i;\n#include "sim/world/a.hpp"\n'}, "module-loop", "sim/world/a.hpp:1"),
    ("a loop across two rooms", {"firmware/board/board.hpp": '#include "firmware/core/b.hpp"\n', "firmware/core/b.hpp": '#include "firmware/core/a.hpp"\n',
                                 "firmware/core/a.hpp": '#include "firmware/board/board.hpp"\n'}, "module-loop", "firmware/board/board.hpp:1"),
    ("two modules share a header", {"sim/world/a.hpp": '#include "sim/world/c.hpp"\n', "sim/world/b.hpp": '#include "sim/world/c.hpp"\n', "sim/world/c.hpp": "",
                                    "sim/world/b.cpp": '#include "sim/world/b.hpp"\n#include "sim/world/a.hpp"\n'}, None, None),
    # Size of folders and rooms
    ("41 source files in a folder", {f"sim/world/x{i}.hpp": "" for i in range(40)}, "folder-size", "sim/world/README.md:1"),
    ("40 source files in a folder", {f"sim/world/x{i}.hpp": "" for i in range(39)}, None, None),
    ("41 tests in a folder", {f"test/unit/host/x{i}.cpp": "" for i in range(41)}, "folder-size", "test/unit/host/README.md:1"),
    ("a room of 18 % of 6 606 lines", {**TEN_ROOMS, **{f"sim/drive/{file}.hpp": "//\n" * 300 for file in "zw"}}, "room-size", "sim/drive/README.md:1"),
    ("ten rooms of 10 %", TEN_ROOMS, None, None),
    ("a room that tests make large", {**TEN_ROOMS, "test/unit/sim/drive/y.cpp": "//\n" * 600, "test/unit/sim/drive/z.cpp": "//\n" * 600}, None, None),
    # The page that describes the house
    ("the page as the tree is", {"docs/architecture.md": house()}, None, None),
    ("a row with another arrow", {"docs/architecture.md": house().replace("| `host/base`, `protocols` |", "| `protocols` |")}, "room-table", "docs/architecture.md:6"),
    ("a room without row", {"docs/architecture.md": house().replace("| `protocols` |  |\n", "")}, "room-table", "docs/architecture.md:1"),
    ("a row with its face", {"docs/architecture.md": house().replace("| `host/vehicle` |", "| `host/vehicle` | a model | `model.hpp` |")}, None, None),
    ("a face that is gone", {"docs/architecture.md": house().replace("| `host/vehicle` |", "| `host/vehicle` | a model | `gone.hpp` |")},
     "room-table", "docs/architecture.md:7"),
    ("a row without room", {"docs/architecture.md": house() + "| `host/gadget` | `protocols` |\n"}, "room-table", "docs/architecture.md:13"),
    ("a hop in a file that is gone", {"docs/architecture.md": house().replace("host/bus/can_bus.hpp: send", "host/bus/gone.hpp: send")},
     "walk", "docs/architecture.md:12"),
    ("a hop to a function that is gone", {"docs/architecture.md": house(), "host/bus/can_bus.hpp": "// send(\n"}, "walk", "docs/architecture.md:12"),
    ("a walk that is longer than it says", {"docs/architecture.md": house().replace("Calls between files: 1 of", "Calls between files: 0 of")},
     "walk", "docs/architecture.md:10"),
    ("a walk too long that does not say missed", {"docs/architecture.md": house().replace("1 of 4", "1 of 0")}, "walk", "docs/architecture.md:10"),
    ("a room entered twice that is not named", {"docs/architecture.md": house().replace("1 of 4", "2 of 4") + "3. `sim/world/bus.hpp: deliver` again.\n"},
     "walk", "docs/architecture.md:10"),
    # (i) the field's words
    ("a private word in a comment", {"host/vehicle/x.hpp": "#pragma once\n// What is believed of the mass.\n"}, "private-word", "host/vehicle/x.hpp:2"),
    ("a private word in a name", {"host/vehicle/x.cpp": "int i;\nint knots_at(double t_s);\n"}, "private-word", "host/vehicle/x.cpp:2"),
    ("a private word in a message", {"sim/world/x.cpp": 'const char* s = "told apart by a climb";\n'}, "private-word", "sim/world/x.cpp:1"),
    ("a private word in a page", {"docs/a.md": "# A\n\nThe model foretells it.\n"}, "private-word", "docs/a.md:3"),
    ("a private word in data", {"effects/a.toml": '# Its twin.\ntwins = ["b"]\n'}, "private-word", "effects/a.toml:1"),
    ("a private word in a script", {"scripts/a.py": "contestants = []\n"}, "private-word", "scripts/a.py:1"),
    ("a key of a file that has such a word", {"sim/world/x.cpp": 'const char* s = "twins";\n', "effects/a.toml": 'twins = ["b"]\n'}, None, None),
    ("a word that holds another", {"docs/a.md": "# A\n\nFortells, knotted, contested, betrayed_by, entwined, told, a forecast.\n"}, None, None),
    # Effects
    ("an effect with its row", {"effects/catalogue.toml": EFFECT, "sim/effects/a.cpp": 'const EffectInfo k{.id = "wet_air"};\n',
                                "bench/hil/flight/x.cpp": 'auto e = effect("wet_air");\n'}, None, None),
    ("a plant without the switch of its row", {"effects/catalogue.toml": EFFECT}, "effect-code", "effects/catalogue.toml:2"),
    ("a switch without row", {"sim/effects/a.cpp": 'const EffectInfo k{\n    .id = "wet_air"};\n'}, "effect-row", "sim/effects/a.cpp:2"),
    ("a term without row", {"host/effects/a.hpp": 'constexpr std::string_view kId = "wet_air";\n'}, "effect-row", "host/effects/a.hpp:1"),
    ("a term that its row promises", {"effects/catalogue.toml": EFFECT.replace("true", "false").replace("none", "term")}, "effect-code",
     "effects/catalogue.toml:2"),
    ("a misspelt effect", {"bench/hil/flight/x.cpp": 'auto e = effect("wet_iar");\n'}, "effect-id", "bench/hil/flight/x.cpp:1"),
    ("an effect named in general code", {"effects/catalogue.toml": EFFECT.replace("true", "false"), "bench/sysid/log/x.cpp": 'auto e = effect("wet_air");\n'},
     "effect-named", "bench/sysid/log/x.cpp:1"),
    ("the term of an effect named in general code", {"bench/sysid/log/x.cpp": "int i;\nf(host::WetAir::kId);\n"}, "effect-named", "bench/sysid/log/x.cpp:2"),
    ("an effect named where its law is", {"effects/catalogue.toml": EFFECT.replace("true", "false"),
                                          "bench/sysid/diagnose/residuals/lag.cpp": 'auto e = effect("wet_air");\n',
                                          "bench/sysid/diagnose/residuals/README.md": "Lags.\n"}, None, None),
    ("a file that needs not name an effect", {"bench/sysid/diagnose/residuals/lag.cpp": "int i;\n", "bench/sysid/diagnose/residuals/README.md": "Lags.\n"},
     "exemption-not-needed", "bench/sysid/diagnose/residuals/lag.cpp:1"),
    ("an effect named past the catalogue", {"effects/catalogue.toml": EFFECT.replace("true", "false"), "bench/hil/flight/x.cpp": 'f("wet_air");\n'},
     "effect-id", "bench/hil/flight/x.cpp:1"),
    # Text is not code
    ("tokens in strings and comments", {"firmware/core/x.cpp": 'const char* s = "throw new double";  /* virtual\n throw */\n'}, None, None),
    ("tokens in a raw string", {"firmware/core/x.cpp": 'auto s = R"x(throw " new)x";\n'}, None, None),
    ("code behind digit separators", {"firmware/core/x.cpp": "int a = 1'000;\ndouble b = 2'000;\n"}, "target-double", "firmware/core/x.cpp:2"),
    ("code behind a quote character", {"firmware/core/x.cpp": "char q = '\"';\ndouble b;\nchar r = '\"';\n"}, "target-double", "firmware/core/x.cpp:2"),
]


class LintTest(unittest.TestCase):
    def test_clean_tree_has_no_finding(self):
        self.assertEqual(findings({}), [])

    def test_each_mistake_is_found_where_it_is_and_nothing_else(self):
        for name, files, rule, where in CASES:
            with self.subTest(name):
                found = [(f.rule, f"{f.path}:{f.line}") for f in findings(files) if f.rule != "include-reach"]
                self.assertEqual(found, [] if rule is None else [(rule, where)])

    def test_ban_is_found_through_a_chain_of_includes(self):
        # Every step is allowed by itself: sim/plant may include host/base. The chain still ends in the controller's model.
        files = {
            "host/base/shared.hpp": '#include "host/vehicle/model.hpp"\n',
            "sim/world/a.hpp": '#include "host/base/shared.hpp"\n',
            "sim/plant/b.cpp": 'int i;\n#include "sim/world/a.hpp"\n',
        }
        found = [f for f in findings(files) if f.rule == "include-reach"]
        self.assertEqual([(f.path, f.line) for f in found], [("sim/plant/b.cpp", 2), ("sim/world/a.hpp", 1)])
        self.assertIn("sim/plant/b.cpp -> sim/world/a.hpp -> host/base/shared.hpp -> host/vehicle/model.hpp", found[0].what)
        self.assertIn("shares no equation", found[0].remedy)

    def test_a_loop_of_modules_is_told_once_with_its_chain_and_the_search_for_banned_files_ends(self):
        files = {"sim/world/a.hpp": '#include "sim/world/b.hpp"\n', "sim/world/b.hpp": '#include "sim/world/a.hpp"\n'}
        self.assertEqual([(f.rule, f.what) for f in findings(files)],
                         [("module-loop", "sim/world/a.hpp includes sim/world/b; sim/world/b.hpp includes sim/world/a")])

    def test_a_loop_that_stands_in_the_table_is_no_finding_and_its_row_goes_with_it(self):
        loop = {"sim/world/a.hpp": '#include "sim/world/b.hpp"\n', "sim/world/b.hpp": "", "sim/world/b.cpp": '#include "sim/world/a.hpp"\n'}
        with mock.patch.dict(rules.MODULE_LOOPS_ALLOWED, {("sim/world/a", "sim/world/b"): "for this test"}):
            self.assertEqual(findings(loop), [])
            self.assertEqual([f.rule for f in findings({**loop, "sim/world/b.cpp": ""})], ["exemption-not-needed"])

    def test_file_compiled_without_the_option_is_named(self):
        good = {"file": "sim/world/a.cpp", "command": "g++ -O2 -ffp-contract=off -c a.cpp"}
        bad = {"file": "sim/world/b.cpp", "arguments": ["g++", "-O2", "-c", "b.cpp"]}
        found = findings({}, [good, bad])
        self.assertEqual([(f.rule, f.path) for f in found], [("float-option", "sim/world/b.cpp")])

    def test_command_reads_a_folder_prints_findings_and_fails(self):
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            for name, text in CLEAN.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
                (root / name).with_name("README.md").write_text("# room\n", encoding="utf-8")
            (root / "build").mkdir()
            (root / "build" / "made.cpp").write_text("not looked at: std::mt19937 g;\n", encoding="utf-8")
            (root / "picture.png").write_bytes(b"\x89PNG\0\0/wo" b"rk/x")
            commands = root / "build" / "compile_commands.json"
            commands.write_text(json.dumps([{"file": "a.cpp", "command": "g++ -ffp-contract=off a.cpp"}]), encoding="utf-8")
            arguments = ["--root", folder, "--compile-commands", str(commands)]
            out = io.StringIO()
            with redirect_stdout(out), redirect_stderr(io.StringIO()):
                self.assertEqual(lint.main(arguments), 0)
                (root / "sim/world/x.cpp").write_text("int i = rand();\n", encoding="utf-8")
                self.assertEqual(lint.main(arguments), 1)
            self.assertEqual(out.getvalue(), "sim/world/x.cpp:1: [std-random] `rand` is not a seeded stream of this house\n"
                                             "  do: use host/base/random.hpp: RandomStream(seed, module)\n")

    def test_every_rule_has_a_case(self):
        promised = {r.id for r in rules.TOKEN_RULES} | {r[0] for r in rules.LEAKS}
        promised |= {"include-arrow", "include-path", "target-header", "float-option", "folder-readme", "file-length", "function-length", "joined-statements",
                     "exemption-not-needed"}
        promised |= {"include-arrow", "include-path", "target-header", "float-option", "folder-readme", "file-length", "exemption-not-needed",
                     "module-loop", "folder-size", "room-size", "room-table", "walk", "private-word", "effect-row", "effect-code", "effect-id",
                     "effect-named"}
        self.assertEqual(promised - {case[2] for case in CASES}, set())

    def test_every_exemption_gives_a_reason(self):
        for rule in rules.TOKEN_RULES:
            for path, reason in rule.except_files.items():
                self.assertGreater(len(reason), 10, f"{rule.id}: {path}")
        for loop, reason in rules.MODULE_LOOPS_ALLOWED.items():
            self.assertGreater(len(reason), 10, f"module-loop: {loop}")

    def test_long_functions_are_few_and_have_reasons(self):
        self.assertLessEqual(len(rules.LONG_FUNCTIONS), rules.MAX_LONG_FUNCTIONS)
        for function, reason in rules.LONG_FUNCTIONS.items():
            self.assertGreater(len(reason), 10, function)

    def test_long_files_are_few_and_have_reasons(self):
        self.assertLessEqual(len(rules.LONG_FILES), rules.MAX_LONG_FILES)
        for file, reason in rules.LONG_FILES.items():
            self.assertGreater(len(reason), 10, file)

    def test_listed_file_may_be_longer_and_must_need_it(self):
        with unittest.mock.patch.object(rules, "LONG_FILES", {"sim/world/x.cpp": "one piece for a good reason"}):
            self.assertEqual(findings({"sim/world/x.cpp": "//\n" * 401}), [])
            self.assertEqual([f.rule for f in findings({"sim/world/x.cpp": "int i;\n" * 601})], ["file-length"])
            self.assertEqual([f.rule for f in findings({"sim/world/x.cpp": "//\n" * 400})], ["exemption-not-needed"])

    def test_listed_function_may_be_longer_up_to_the_hard_limit(self):
        listed = unittest.mock.patch.object(rules, "LONG_FUNCTIONS", {"sim/world/x.cpp: f": "one piece for a good reason"})
        text = "void f() {\n" + "  i;\n" * (rules.HARD_MAX_FUNCTION_LINES - 2) + "}\n"
        with listed:
            self.assertEqual(findings({"sim/world/x.cpp": text}), [])
            self.assertEqual([f.rule for f in findings({"sim/world/x.cpp": text.replace("}", "  i;\n}")})], ["function-length"])
            self.assertEqual([f.rule for f in findings({"sim/world/x.cpp": "void f() {\n}\n"})], ["exemption-not-needed"])

    def test_every_finding_says_what_to_do(self):
        for name, files, rule, _ in CASES:
            for f in findings(files) if rule else []:
                with self.subTest(name):
                    self.assertTrue(f.what and f.remedy)
                    self.assertNotIn("{0}", f.what)


if __name__ == "__main__":
    unittest.main()
