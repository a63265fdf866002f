// `rotorloop mcu info`: an ELF against the memories of the chip, its vector table, and what takes the space.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/mcu/mcu_commands.hpp"
#include "sim/mcu/elf/program.hpp"

namespace rotorloop::cli {
namespace {

using Json = nlohmann::ordered_json;
using namespace mcu;

struct InfoArguments {
  std::vector<std::filesystem::path> files;
  size_t largest = 15;
  bool json = false;
};

std::string hex(uint32_t value) { return fmt::format("{:#010x}", value); }

// Bytes of a memory that the sections of all files take: what is loaded into it, and what the program has in it.
uint32_t used(const ProgramMemory& memory, const std::vector<ElfFile>& files) {
  uint32_t bytes = 0;
  for (const ElfFile& file : files)
    for (const ElfSection& s : file.sections) {
      const bool elsewhere = s.run_address != s.load_address;
      if (memory.holds(s.run_address, 1)) bytes += s.size_bytes;
      if (elsewhere && !s.bytes.empty() && memory.holds(s.load_address, 1)) bytes += static_cast<uint32_t>(s.bytes.size());
    }
  return bytes;
}

Json memories_json(const std::vector<ElfFile>& files) {
  Json rows = Json::array();
  for (const ProgramMemory& m : stm32g431_memories())
    rows.push_back({{"memory", m.name}, {"address", m.base}, {"size_bytes", m.size_bytes}, {"used_bytes", used(m, files)}});
  return rows;
}

Json file_json(const ElfFile& file, size_t largest) {
  const VectorTable table = vector_table(file, stm32g431_memories());
  Json sections = Json::array(), vectors = Json::array(), symbols = Json::array();
  for (const ElfSection& s : file.sections)
    sections.push_back({{"name", s.name},
                        {"address", s.run_address},
                        {"load_address", s.bytes.empty() ? Json() : Json(s.load_address)},
                        {"size_bytes", s.size_bytes},
                        {"kind", s.executable      ? "code"
                                 : s.bytes.empty() ? "cleared"
                                 : s.writable      ? "data"
                                                   : "constants"}});
  for (size_t i = 0; i < table.vectors.size(); ++i)
    if (table.vectors[i] != 0)
      vectors.push_back({{"exception", i + 1},
                         {"name", exception_name(static_cast<uint32_t>(i + 1))},
                         {"address", table.vectors[i]},
                         {"handler", file.place(table.vectors[i])}});
  std::vector<ElfSymbol> by_size = file.symbols;
  std::ranges::stable_sort(by_size, std::greater{}, &ElfSymbol::size_bytes);
  for (const ElfSymbol& s : by_size) {
    if (symbols.size() == largest) break;
    symbols.push_back({{"name", s.name},
                       {"address", s.address},
                       {"size_bytes", s.size_bytes},
                       {"kind", s.function ? "function" : "object"},
                       {"source_file", s.source_file.empty() ? Json() : Json(s.source_file)}});
  }
  return {{"file", file.path.generic_string()},
          {"entry", file.entry},
          {"entry_function", file.place(file.entry)},
          {"stack_pointer", table.stack_pointer},
          {"vector_table", table.address},
          {"vectors", vectors},
          {"sections", sections},
          {"largest", symbols}};
}

// Handlers that many vectors share stand once, with the exceptions that they serve.
void print_vectors(const Json& vectors) {
  std::map<std::string, std::vector<std::string>> by_handler;
  for (const Json& v : vectors) by_handler[v["handler"].get<std::string>()].push_back(v["name"].get<std::string>());
  std::vector<std::string> shown;
  for (const Json& v : vectors) {
    const auto handler = v["handler"].get<std::string>();
    const auto& served = by_handler[handler];
    if (std::ranges::find(shown, handler) != shown.end()) continue;
    shown.push_back(handler);
    const std::string names =
        served.size() > 2 ? fmt::format("{} and {} more", served[0], served.size() - 1) : fmt::format("{}", fmt::join(served, ", "));
    fmt::print("  {:<28} {:<12} {}\n", names, hex(v["address"].get<uint32_t>()), handler);
  }
}

void print_file(const Json& file) {
  fmt::print("\n{}: entry {} ({})\n", file["file"].get<std::string>(), hex(file["entry"].get<uint32_t>()),
             file["entry_function"].get<std::string>());
  fmt::print("  {:<28} {:<12} {:<12} {:>8}  {}\n", "section", "address", "loaded at", "bytes", "kind");
  for (const Json& s : file["sections"])
    fmt::print("  {:<28} {:<12} {:<12} {:>8}  {}\n", s["name"].get<std::string>(), hex(s["address"].get<uint32_t>()),
               s["load_address"].is_null() ? "-" : hex(s["load_address"].get<uint32_t>()), s["size_bytes"].get<uint32_t>(),
               s["kind"].get<std::string>());
  fmt::print("vector table at {}, stack pointer {}\n", hex(file["vector_table"].get<uint32_t>()),
             hex(file["stack_pointer"].get<uint32_t>()));
  print_vectors(file["vectors"]);
  fmt::print("largest of what it holds\n");
  for (const Json& s : file["largest"])
    fmt::print("  {:>8} bytes  {}{}\n", s["size_bytes"].get<uint32_t>(), s["name"].get<std::string>(),
               s["source_file"].is_null() ? "" : " (" + s["source_file"].get<std::string>() + ")");
}

int info(const InfoArguments& o) {
  std::vector<ElfFile> files;
  for (const auto& path : o.files) {
    files.push_back(read_elf(path));
    check_sections(files.back(), stm32g431_memories());
  }
  check_overlap(files);
  Json document{{"memories", memories_json(files)}, {"files", Json::array()}};
  for (const ElfFile& file : files) document["files"].push_back(file_json(file, o.largest));
  if (o.json) {
    fmt::print("{}\n", document.dump(2));
    return 0;
  }
  fmt::print("{:<30} {:<12} {:>8} {:>8} {:>8}\n", "memory of the STM32G431", "address", "bytes", "used", "free");
  for (const Json& m : document["memories"]) {
    const auto size = m["size_bytes"].get<uint32_t>(), taken = m["used_bytes"].get<uint32_t>();
    fmt::print("{:<30} {:<12} {:>8} {:>8} {:>8}\n", m["memory"].get<std::string>(), hex(m["address"].get<uint32_t>()), size, taken,
               int64_t{size} - taken);
  }
  for (const Json& file : document["files"]) print_file(file);
  return 0;
}

}  // namespace

void add_mcu_info(CLI::App& mcu_group, int& exit_code) {
  auto o = std::make_shared<InfoArguments>();
  CLI::App* c = mcu_group.add_subcommand("info", "what an ELF holds: sections against the memories, vector table, largest parts");
  c->add_option("elf", o->files, "programs as the linker wrote them; a bootloader and an application are two files")->required();
  c->add_option("--largest", o->largest, "how many functions and objects to list, by size")->capture_default_str();
  c->add_flag("--json", o->json, "the same for programs: addresses as numbers, sizes in bytes");
  c->footer(
      "Refused, with exit code 2: no ELF, not for ARM, a section outside of the chip's memories, an entry outside of flash, no stack "
      "pointer,\n"
      "two files on one address.\n"
      "A section takes its memory where the program has it (address) and, when it is copied at start, where it is loaded too.\n"
      "Examples:\n"
      "  rotorloop mcu info esc.elf\n"
      "  rotorloop mcu info bootloader.elf esc.elf           # do they fit together?\n"
      "  rotorloop mcu info esc.elf --json | jq '.memories'");
  c->callback([o, &exit_code] { exit_code = info(*o); });
}

}  // namespace rotorloop::cli
