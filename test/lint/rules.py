"""The rules of the house that a machine can check. This file is the table; lint.py applies it.

To allow one more include arrow, add it to ARROWS. To exempt a file, add it to the rule's `except_files` with the reason;
an exemption that no longer suppresses anything is itself reported.
"""

from dataclasses import dataclass, field

SOURCE_SUFFIXES = (".cpp", ".hpp", ".c", ".h", ".cc", ".hh", ".inc")
SCRIPT_SUFFIXES = (".py", ".sh")
VENDORED = "third_party"  # code of others keeps the style it came with; its README says where from, its checksums that it is as it was taken in

# --- (a) include arrows -----------------------------------------------------------------------------------------------
# Room -> what it may include beside itself: folders (with all below them) or single files. The longest matching room counts.
# A file in a folder that has no row is refused: a new room says here what it stands on.
# What rooms that only know data may stand on: nothing of the simulated world.
DATA_SIDE = ["host/base", "host/vehicle", "host/effects"]
# What rooms that fly simulations may stand on beside data.
WITH_WORLD = DATA_SIDE + ["sim", "host/bus", "host/estimate", "host/control", "host/node", "firmware", "protocols"]
ARROWS = {
    "protocols": [],
    "firmware/core": ["protocols", "firmware/board/board.hpp"],  # board.hpp is the concept, not a board
    "firmware/board": ["firmware/core", "protocols"],
    "firmware/update": ["firmware/core", "protocols", "third_party/ed25519"],
    "firmware/boot": ["firmware", "protocols"],
    "firmware/app": ["firmware", "protocols"],
    "host/base": [],
    "host/bus": ["host/base", "protocols"],
    "host/vehicle": ["host/base"],
    "host/effects": ["host/base", "host/vehicle"],
    "host/estimate": ["host/base", "host/vehicle"],
    "host/control": ["host/base", "host/vehicle", "host/effects", "host/estimate/samples.hpp"],
    "host/node": ["host/base", "host/bus", "host/vehicle", "host/effects", "host/estimate", "host/control", "protocols"],
    "host/tools": ["host/base", "host/bus", "host/node", "protocols"],
    "sim/world": ["host/base", "host/bus", "protocols"],
    "sim/rotor": ["host/base", "sim/world"],
    "sim/drive": ["host/base", "sim/world"],
    "sim/airframe": ["host/base", "sim/world", "sim/rotor"],
    "sim/effects": ["host/base", "sim/world", "sim/rotor", "sim/airframe", "sim/drive", "sim/sensor", "sim/esc/esc_setup.hpp"],
    "sim/sensor": ["host/base", "host/bus", "sim/world", "sim/airframe", "protocols"],
    "sim/esc": ["host/base", "host/bus", "sim/world", "sim/drive", "sim/mcu", "firmware", "protocols"],
    "sim/mcu": ["host/base", "host/bus", "sim/world", "sim/drive"],  # a chip that runs programs knows none of ours
    "sim/mcu/core": [],
    "sim/plant": ["host/base", "sim"],
    # bench: first what reads and explains data, then what flies, then studies that use both
    "bench/render": [],
    "bench/sysid/log": ["host/base", "host/vehicle"],
    "bench/sysid/estimate": DATA_SIDE + ["bench/sysid/log"],
    "bench/sysid/score": DATA_SIDE + ["bench/sysid/log", "bench/sysid/estimate"],
    "bench/sysid/identify": DATA_SIDE + ["bench/sysid/log", "bench/sysid/estimate", "bench/sysid/score", "bench/render"],
    "bench/sysid/diagnose": DATA_SIDE + ["bench/sysid", "bench/render"],
    "bench/stand": ["host/base"],
    "bench/stand/instruments": ["host/base", "bench/stand/run_folder.hpp"],
    "bench/stand/run": ["host/base", "host/bus", "host/tools", "protocols", "bench/stand/instruments", "bench/stand/run_folder.hpp", "bench/sysid/log"],
    "bench/stand/virtual": ["host/base", "host/bus", "host/tools", "sim", "firmware", "protocols", "bench/stand/instruments", "bench/stand/run"],
    "bench/stand/evaluate": DATA_SIDE + ["bench/stand/run_folder.hpp", "bench/sysid/log", "bench/sysid/diagnose/verdict.hpp", "bench/render"],
    "bench/hil/controllers": ["host/base", "host/control", "host/vehicle"],
    "bench/hil/flight": WITH_WORLD + ["bench/hil/controllers", "bench/sysid/log", "bench/render"],
    "bench/hil/calibrate": WITH_WORLD + ["bench/sysid/log", "bench/render"],
    "bench/hil/live": ["host/base", "host/bus", "host/node", "host/tools", "sim", "firmware", "protocols"],
    "bench/hil/processes": WITH_WORLD + ["bench/hil/flight"],
    "bench/hil/esc_lab": WITH_WORLD + ["bench/render", "bench/hil/flight"],
    "bench/hil/closed_loop": WITH_WORLD + ["bench/sysid/log", "bench/render", "bench/hil/flight"],
    "bench/propeller": WITH_WORLD + ["bench/render"],
    "bench/studies": DATA_SIDE + ["bench/sysid/log", "bench/sysid/estimate", "bench/sysid/score", "bench/stand/evaluate", "bench/sysid/diagnose/verdict.hpp"],
    "cli": ["bench", "sim", "host", "firmware", "protocols"],
    "docs/examples/own_controller": ["host/control/controller_abi.h"],  # what a user writes: the C header alone
    "test": ["test", "cli", "bench", "sim", "host", "firmware", "protocols", "third_party/ed25519"],
}

# What must not be reached by any chain of includes, whatever the rows above allow step by step.
# (folder, folders exempt from it, what it never reaches, why)
NEVER_REACHES = [
    ("sim", [], ["host/vehicle", "host/control", "host/estimate", "host/effects", "host/node", "bench"],
     "the plant shares no equation with the model under test"),
    ("sim/mcu", [], ["firmware"], "the emulated chip fits any program, not ours"),
    ("host", [], ["sim", "bench", "cli"], "the controller must build and run without the simulated world"),
    *((room, [], ["sim", "firmware", "host/control", "host/node", "cli"], "what explains data must never see the plant")
      for room in ("bench/sysid", "bench/stand/evaluate", "bench/studies")),
    ("bench/render", [], ["bench/sysid", "bench/stand", "bench/hil", "sim"], "pages and plots know plain values, and no command"),
    ("firmware", [], ["host", "sim", "bench"], "firmware has no host"),
    ("protocols", [], ["firmware", "host", "sim", "bench"], "the wire depends on nothing"),
]

GENERATED_HEADERS = ["rotorloop_version.hpp", "rotorloop_effects.hpp"]  # made by CMake in the build folder

# --- (b) headers of what runs on a target -----------------------------------------------------------------------------
TARGET_ROOMS = ["firmware/core", "firmware/board/g431", "firmware/update", "firmware/boot", "firmware/app", "protocols"]
TARGET_HEADERS = {
    "algorithm", "array", "bit", "cfloat", "climits", "cmath", "compare", "concepts", "cstddef", "cstdint", "initializer_list",
    "limits", "optional", "span", "type_traits", "version",
}


# --- token rules ------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class TokenRule:
    id: str
    where: list       # folders or files
    pattern: str      # on source text without comments and string literals
    what: str         # {0} is the text found
    remedy: str
    except_files: dict = field(default_factory=dict)  # path -> reason


LOCKSTEP_ROOMS = ["sim", "host/control", "host/estimate", "host/vehicle", "host/effects", "firmware", "protocols"]

_CLOCK = (r"\b(?:std::)?chrono::\w*clock\b|\b(?:steady|system|high_resolution)_clock\b|\bclock_gettime\b|\bgettimeofday\b"
          r"|\bstd::time\s*\(|(?<![\w.>:])time\s*\(\s*(?:NULL|nullptr|0|&)|\bstd::clock\s*\(|\bsleep_(?:for|until)\b|\b(?:nano|u)sleep\b"
          r"|\b__rdtsc\b")

TOKEN_RULES = [
    # (b) no heap, exceptions, RTTI, virtual calls in what runs on a target
    TokenRule("target-new", TARGET_ROOMS, r"\bnew\b(?!\s*\.)|\bmalloc\s*\(", "`{0}` in code for a target", "use a member or std::array: there is no heap"),
    TokenRule("target-throw", TARGET_ROOMS, r"\bthrow\b|\btry\b|\bcatch\b", "`{0}` in code for a target", "return a status; count the abnormal branch"),
    TokenRule("target-virtual", TARGET_ROOMS, r"\bvirtual\b", "`{0}` in code for a target", "use a concept and a template parameter"),
    TokenRule("target-rtti", TARGET_ROOMS, r"\bdynamic_cast\b|\btypeid\b", "`{0}` in code for a target", "the build has no RTTI: decide by an enum"),
    TokenRule("target-string", TARGET_ROOMS, r"\bstd::string\b|\bstd::vector\b", "`{0}` in code for a target", "use std::array or std::span"),
    TokenRule("target-double", ["firmware/core", "firmware/update", "firmware/app"], r"\bdouble\b", "`{0}` in firmware/core", "the FPU is single precision: use float and an f suffix"),
    TokenRule("target-double", ["protocols"], r"\bdouble\b", "`{0}` in protocols", "use float, or exempt a file that no ESC includes",
              {"protocols/state_channel.hpp": "airframe state for the flight computer (double precision FPU); no ESC includes it"}),
    # (c) one clock, one source of random numbers
    TokenRule("wall-clock", LOCKSTEP_ROOMS, _CLOCK, "`{0}` reads a wall clock or waits", "take the time as an argument (sim/world/virtual_time.hpp)"),
    TokenRule("wall-clock", ["bench", "cli"], _CLOCK, "`{0}` reads a wall clock or waits",
              "lockstep runs know virtual time only; a real-time pacer or progress line goes into its own file, listed here",
              {"bench/hil/flight/cost_meter.hpp": "cost of each module for the report; never an input of the loop, never hashed",
               "host/base/run_clock.hpp": "when a run started and how long it took, for people; never hashed",
               "bench/stand/instruments/port_clock.hpp": "the time of bytes on a real port; nothing in virtual time includes it",
               "cli/progress/progress_line.hpp": "how long to wait, on stderr",
               "cli/stand/run_page.hpp": "twenty values a second to a page, and virtual time held to the clock",
               "cli/stand/run_page.cpp": "twenty values a second to a page, and virtual time held to the clock",
               "cli/progress/identify_progress.hpp": "how long a fit has taken and has left, on stderr"}),
    TokenRule("std-random", LOCKSTEP_ROOMS + ["bench", "host"],
              r"\bstd::mt19937\w*|\bstd::\w+_engine\b|\brandom_device\b|\b\w+_distribution\b|(?<![\w.>:])s?rand\s*\(|\bstd::s?rand\s*\(|\bdrand48\b",
              "`{0}` is not a seeded stream of this house", "use host/base/random.hpp: RandomStream(seed, module)"),
    # (d) functions whose last bit depends on the CPU or the C library
    TokenRule("libm", ["sim", "host/control", "host/estimate", "host/vehicle", "host/effects", "firmware/core"],
              r"(?<![\w.>:])(?:std::|::)?(?:sin|cos|tan|sincos|asin|acos|atan|atan2|sinh|cosh|tanh|exp|exp2|expm1|log|log2|log10|log1p|pow|hypot|cbrt"
              r"|erf|erfc|tgamma|lgamma)[fl]?\s*\((?!\s*\))",
              "`{0}` gives other bits on another CPU or library", "use host/base/elementary.hpp (double) or the firmware's own float version",
              {"sim/rotor/bench_rotor.cpp": "a speed measurement; makes up inputs, is in no run"}),
    TokenRule("libm", ["sim", "host/control", "host/estimate", "host/vehicle", "host/effects"],
              r"\bAngleAxis[df]?\b|\.slerp\s*\(|\beulerAngles\s*\(|\bangularDistance\s*\(", "`{0}` of Eigen calls libm inside",
              "write the rotation with host/base/elementary.hpp"),
    # (e) floating point as written
    TokenRule("float-pragma", ["sim", "host", "firmware", "protocols", "bench"], r"#\s*pragma\s+(?:STDC\s+FP_CONTRACT|GCC\s+optimize)|\boptimize\s*\(\s*\"",
              "`{0}` changes floating point for one file", "remove it: runs are compared bit by bit"),
    # (f) no heap in the control loop
    TokenRule("loop-heap", ["host/control", "host/estimate"],
              r"\bstd::(?:vector|string|map|unordered_map|deque|list|function|make_unique|make_shared|unique_ptr|shared_ptr)\b|\bnew\b|\bMatrixXd\b|\bVectorXd\b",
              "`{0}` in the control loop", "use a fixed-size array; a file that only runs at set-up is listed in test/lint/rules.py",
              {path: "reads or makes trajectories and gains before the flight"
               for path in ("host/control/trajectory_file.cpp", "host/control/trajectory_file.hpp", "host/control/trajectory_generator.cpp",
                            "host/control/trajectory_generator.hpp", "host/control/shipped_trajectories.cpp", "host/control/diagnose_trajectories.cpp",
                            "host/control/sway.cpp", "host/control/sway.hpp")}),
]

# --- (e) build options ------------------------------------------------------------------------------------------------
REQUIRED_OPTION = ("cmake/options.cmake", "-ffp-contract=off")
BUILD_FILES = ("CMakeLists.txt", "CMakePresets.json", ".cmake", ".sh", "scripts/", ".ci/")
FORBIDDEN_OPTIONS = (r"-ffast-math|-Ofast|-funsafe-math-optimizations|-fassociative-math|-freciprocal-math|-march=[\w-]+|-mfma|-mavx\w*"
                     r"|-ffp-contract=(?!off)\w+")

# --- (g) files and folders --------------------------------------------------------------------------------------------
MAX_LINES = 400       # of a file of the product
MAX_TEST_LINES = 600  # of a test
LONG_FILES = {}       # product file -> why it is one piece; at most MAX_LONG_FILES
MAX_LONG_FILES = 5
MAX_FUNCTION_LINES = 60        # from its first line to its closing brace, with the lambdas inside it
HARD_MAX_FUNCTION_LINES = 80  # of an exception
MAX_LONG_FUNCTIONS = 3         # exceptions
LONG_FUNCTIONS = {             # "path: function" -> why it is one piece
    "bench/sysid/estimate/grid_flight.cpp: make_grid": "one stream after the other onto the grid, each in a line or two",
    "bench/sysid/diagnose/report/rejection_text.cpp: sentence": "one case for each reason",
    "cli/cmd_identify.cpp: add_identify": "one row for each option",
}
MAX_FOLDER_FILES = 40  # source files in one folder, those of its subfolders not counted
MAX_ROOM_SHARE = 0.15  # of all shipped lines (everything but tests), for a room as in ARROWS
ROOM_SHARE_FROM_LINES = 5000  # of the whole tree; in a smaller one any room is a large share
README_NOT_NEEDED_BELOW = ["test/unit", "test/integration", "test/bench"]  # they mirror the rooms; test/README.md speaks for them

# A module is a header with its source file. Loops that stand although they are loops: modules in the order of the alphabet -> reason.
MODULE_LOOPS_ALLOWED = {}

# --- the house on one page --------------------------------------------------------------------------------------------
# Its table has a row for each shipped room of ARROWS with what the room may include; its walks name a file and a function at each hop.
HOUSE_PAGE = "docs/architecture.md"

# --- (j) the effects that code and catalogue have ---------------------------------------------------------------------
CATALOGUE = "effects/catalogue.toml"
EFFECT_ROOMS = ("bench/", "cli/", "host/control/", "host/vehicle/")  # they take an effect's row, and do not spell its id
EFFECT_ID_EXEMPT = {
    "bench/hil/flight/effect_probe.cpp": "a table of probes by the plant's switches; each is looked up before it flies",
    "bench/sysid/identify/report/identify_result.cpp": "thrust_scale is a key of result.json: the scale of the start values",
    "bench/sysid/estimate/model/parameters.cpp": "pose_delay is the name of a parameter of the fit",
    "host/control/effect_feed_forward.cpp": "runs on the target, where no catalogue is",
}
# General code of these rooms names no effect at all, not even by its row: it asks the row, or the traits of the term (host/effects/term.hpp).
EFFECT_FREE_ROOMS = ("bench/sysid/",)
EFFECT_NAMED_IN = {  # file -> which law of its own it holds
    "bench/sysid/diagnose/ranking/gust.cpp": "the law of wind that fluctuates, for which there is no term",
    "bench/sysid/diagnose/residuals/lag.cpp": "the table of what makes a residual late or early on an axis",
    "bench/sysid/diagnose/residuals/steps_in_time.cpp": "the table of what changes at once during a flight",
    "bench/sysid/diagnose/residuals/variance_kinds.cpp": "the table of laws of the scatter, one for each effect of kind variance",
}

# --- (h) words that must not be committed -----------------------------------------------------------------------------
LEAKS = [
    ("machine-path", r"(?<![\w.~-])/(?:work|root|home)/\S*", "path of one machine: {0}", "use a path relative to the repository, or ROTORLOOP_DATA"),
    ("unfinished", r"\b(?:TO" r"DO|FIX" r"ME|X{3})\b", "unfinished work: {0}", "finish it, or describe the gap in the folder's README under \"Known gaps\""),
]
LEAK_EXEMPT = {"test/lint/lint_test.py": "feeds the linter what it has to find"}

# --- (i) the field's words instead of private ones --------------------------------------------------------------------
# (pattern, what the field says). Whole words or parts of a snake_case name, in code, comments, messages, scripts, data and docs; docs/glossary.md
# explains the terms.
PRIVATE_WORDS = [
    (r"(?<![a-z])(?:beliefs?|believ\w+)|Belie[fv]\w*", "prior; nominal model (of a vehicle file); estimate"),
    (r"(?<![a-z])known_first|KnownFirst", "staged fit"),
    (r"(?<![a-z])contest(?:ants?)?(?![a-z])|Contest(?:ant)?(?![a-z])", "candidate; ranking, best"),
    (r"(?<![a-z])tower(?:s|ing)(?![a-z])|kTowers", "strongest"),
    (r"(?<![a-z])twins?(?![a-z])|Twins?(?![a-z])", "indistinguishable effects, alias, class"),
    (r"(?<![a-z])t(?:old|ell|ells|elling)\s+(?:them |two effects |\w+ )?apart", "distinguish, indistinguishable"),
    (r"(?<![a-z])evenness|Evenness", "heterogeneity"),
    (r"remember_again", "re-propagate"),
    (r"(?<![a-z])knots?(?![a-z])|(?<![a-z])k(?:At)?Knot", "node"),
    (r"(?<![a-z])tie_poses", "associate with a node"),
    (r"(?<![a-z])foret(?:ell|ells|old|elling)(?![a-z])|Foret(?:ell|old)", "predict"),
    (r"(?<![a-z])late poses(?![a-z])|(?<![a-z])late_poses", "pose time offset"),
    (r"\b(?:rotor|blade-element) solve\b", "BEM rotor model, blade-element model"),
    (r"\b(?:missing|lacking) (?:force|torque|wrench)\b", "residual force"),
    (r"\bbetrays?\b", "signature"),
    (r"(?<![a-z])analysts?(?![a-z])|Analyst", "sandboxed diagnosis"),
    (r"\bDesk\b|\b(?:the|a|its) desk\b|on_desk", "sandbox, workspace"),
    (r"\bk(?:Told|Still|Twin)\b", "a name that says what the number bounds"),
    (r"(?<![a-z])winners?(?![a-z])|Winner", "best"),
    (r"\bterms? with memory\b|Memory(?:Input|Ends)|MeasuredMemory|memory_(?:input|scan)(?![a-z])", "dynamic term"),
    (r"Reading(?:Change|Slope|Cost)|reading_terms", "measurement"),
    (r"(?:Vehicle|Thrust)Beside|BesideColumn|too_little_beside", "comparison"),
    (r"Trail(?:Point|Reference)|(?<![a-z])read_trail|(?<![a-z])trail_(?:point|html|figure)", "parameter history"),
    (r"\b(?:can|cannot|could not|can no longer) (?:be told|tell)\b|\bhard to tell\b", "determine, distinguish"),
    (r"\bflights ask for different\b", "estimates differ significantly between flights"),
    (r"\bRunTelling\b|\btell_end\b|(?<![a-z])told_(?!to)", "report, print; reported"),
    (r"\bPilotWish\b|\bParameterWishes\b", "pilot command; parameter selection"),
    (r"\bkTheirs\b|\bget_in_step\b|\blast_words\b|\bQuality::not_there\b", "a map by name; synchronize; last line; absent"),
    (r"\bparted by\b|\bhouse's manners\b", "separated by; style"),
    (r"\bthe loop closed:|\bundeclared effects?\b", "closed-loop study; unmodelled effect"),
]
# Keys of files and options that have such a word, and words of other fields: what matches here is not looked at.
PRIVATE_WORDS_ALLOWED = (
    r"\"twins\"|\btwins = \[|`twins`|(?:facts|row)(?:\.|->)twins|std::vector<std::string> twins\b|class, twins,|its twins not by flight"
    r"|\"analyst\"|\[analyst\]|--analyst|`analyst\.identify`|o(?:->|\.)analyst|vehicle, analyst, out|const auto analyst|analyst->"
    r"|(?:arms|hubs)_believed_\w+|\bbelieved = \{|\"believed\"|group = \"belief\"|^#   believed "
    r"|quartic_knot|\bKnot\b"
    r"|Sending& winner|winner\.time_ns"
    r"|cannot tell: need")  # a verdict of `stand compare`
PRIVATE_WORD_SUFFIXES = SOURCE_SUFFIXES + (".md", ".toml", ".py", ".sh", ".txt", ".cmake")
PRIVATE_WORD_EXEMPT = {
    "test/lint/rules.py": "this list",
    "test/lint/lint_test.py": "feeds the linter what it has to find",
}
