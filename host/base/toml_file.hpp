// Reading TOML with one style of errors: every value is asked for with its unit and range, every error names file, line,
// key, value and remedy, and a key that nobody asked for is an error too (a misspelt key must not be silently ignored).
#pragma once
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace rotorloop {

// A closed interval with the unit it is in; the text of a range error is made from it.
struct Range {
  double min;
  double max;
  std::string_view unit;  // "1" for a dimensionless quantity
};

class TomlTable;

// One parsed file. Keep it alive while tables read from it are in use.
class TomlFile {
 public:
  // Throws Error (ExitCode::usage) when the file cannot be read or parsed, with line and column.
  static TomlFile read(const std::filesystem::path& path);
  static TomlFile parse(std::string_view text, const std::filesystem::path& name_for_errors);
  TomlFile(TomlFile&&) noexcept;
  TomlFile& operator=(TomlFile&&) noexcept;
  ~TomlFile();

  TomlTable root() const;
  const std::filesystem::path& path() const;
  // Reads root key "format" and refuses any other than those given.
  int format(std::initializer_list<int> known) const;
  // Throws for the first key (in file order) that no accessor asked for.
  void refuse_unknown_keys() const;

 private:
  struct Impl;
  explicit TomlFile(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
  friend class TomlTable;
};

// A table inside a file. Accessors throw Error for: key missing, wrong type, out of range, not finite.
class TomlTable {
 public:
  double number(std::string_view key, Range range) const;
  double number(std::string_view key, Range range, double fallback) const;
  std::int64_t integer(std::string_view key, std::int64_t min, std::int64_t max) const;
  std::int64_t integer(std::string_view key, std::int64_t min, std::int64_t max, std::int64_t fallback) const;
  bool boolean(std::string_view key) const;
  bool boolean(std::string_view key, bool fallback) const;
  std::string text(std::string_view key) const;
  std::string text(std::string_view key, std::string_view fallback) const;
  // One of the listed words; the error lists them.
  std::string choice(std::string_view key, std::initializer_list<std::string_view> words) const;
  std::string choice(std::string_view key, std::initializer_list<std::string_view> words, std::string_view fallback) const;
  // A path, taken relative to the folder of this file; must exist.
  std::filesystem::path file(std::string_view key) const;
  // Exactly `count` numbers (count 0: any length ≥ 1).
  std::vector<double> numbers(std::string_view key, std::size_t count, Range range) const;
  std::vector<std::string> texts(std::string_view key) const;
  std::vector<std::int64_t> integers(std::string_view key, std::int64_t min, std::int64_t max) const;

  bool has(std::string_view key) const;
  bool is_array(std::string_view key) const;  // for keys that take one value or a list of them
  TomlTable table(std::string_view key) const;
  std::optional<TomlTable> optional_table(std::string_view key) const;
  // [[key]] entries, at least `min_count`, at most `max_count`; an absent key counts as zero entries.
  std::vector<TomlTable> tables(std::string_view key, std::size_t min_count, std::size_t max_count) const;
  // All keys, in file order (for tables whose keys are names).
  std::vector<std::string> keys() const;
  // Takes every key of this table as asked for (for a table that another reader will check).
  void accept_all() const;

  // "file:line" of this table, or of a key in it.
  std::string where() const;
  std::string where(std::string_view key) const;
  // For checks that need more than a range: throws with this key's position and value.
  [[noreturn]] void fail(std::string_view key, std::string what, std::string likely, std::string remedy) const;

 private:
  friend class TomlFile;
  TomlTable(const void* node, std::string name, TomlFile::Impl* file) : node_(node), name_(std::move(name)), file_(file) {}
  const void* node_;  // toml::table, kept out of this header: toml++ costs seconds per translation unit
  std::string name_;  // dotted path, for messages
  TomlFile::Impl* file_;
};

// Shortest text that reads back to the same number; used in every message and file we write.
std::string number_text(double value);

}  // namespace rotorloop
