#include "host/base/toml_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#define TOML_EXCEPTIONS 1
#include <toml++/toml.h>

#include "host/base/error.hpp"
#include "host/base/nearest.hpp"

namespace rotorloop {

struct TomlFile::Impl {
  std::filesystem::path path;
  toml::table root;
  std::set<const toml::node*> asked;                      // nodes that some accessor has read
  std::map<const void*, std::vector<std::string>> known;  // of each table: the keys that its reader knows, there or not
};

namespace {

const toml::table& as_table(const void* node) { return *static_cast<const toml::table*>(node); }

std::string position(const std::filesystem::path& path, const toml::source_region& region) {
  return fmt::format("{}:{}", path.generic_string(), region.begin.line);
}

// The place inside the line, behind what is wrong with it.
std::string at_column(std::string what, const toml::source_region& region) {
  return region.begin.column ? fmt::format("{} (column {})", what, region.begin.column) : what;
}

std::string_view type_name(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "a text";
    case toml::node_type::integer:
      return "an integer";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "a boolean";
    default:
      return "a date or time";
  }
}

std::string value_text(const toml::node& node) {
  if (auto v = node.value<std::string>()) return "\"" + *v + "\"";
  if (node.is_boolean()) return *node.value<bool>() ? "true" : "false";
  if (node.is_integer()) return std::to_string(*node.value<std::int64_t>());
  if (node.is_floating_point()) return number_text(*node.value<double>());
  return std::string(type_name(node));
}

std::string range_text(const Range& r) {
  const std::string unit = r.unit == "1" ? "" : " " + std::string(r.unit);
  return fmt::format("{} to {}{}", number_text(r.min), number_text(r.max), unit);
}

}  // namespace

std::string number_text(double value) { return fmt::format("{}", value); }

TomlFile::TomlFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TomlFile::TomlFile(TomlFile&&) noexcept = default;
TomlFile& TomlFile::operator=(TomlFile&&) noexcept = default;
TomlFile::~TomlFile() = default;

TomlFile TomlFile::read(const std::filesystem::path& path) {
  std::error_code ec;
  if (std::filesystem::is_directory(path, ec)) throw Error({path.generic_string(), "is a folder, not a file", "", "name a file in it"});
  if (!std::filesystem::is_regular_file(path, ec))
    throw Error({path.generic_string(), "no such file", "",
                 "check the path; on the command line it is relative to the folder where the command runs"});
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw Error({path.generic_string(), "cannot be read", "", "check its permissions"});
  return parse(text.str(), path);
}

TomlFile TomlFile::parse(std::string_view text, const std::filesystem::path& name) {
  auto impl = std::make_unique<Impl>();
  impl->path = name;
  try {
    impl->root = toml::parse(text, name.generic_string());
  } catch (const toml::parse_error& e) {
    throw Error({position(name, e.source()), at_column(fmt::format("not valid TOML: {}", e.description()), e.source()), "",
                 "see https://toml.io for the syntax; strings need quotes, decimals need a digit on both sides of the point"});
  }
  return TomlFile(std::move(impl));
}

const std::filesystem::path& TomlFile::path() const { return impl_->path; }
TomlTable TomlFile::root() const { return TomlTable(&impl_->root, "", impl_.get()); }

int TomlFile::format(std::initializer_list<int> known) const {
  const auto value = static_cast<int>(root().integer("format", 1, 1000));
  if (std::find(known.begin(), known.end(), value) != known.end()) return value;
  root().fail("format", fmt::format("format = {} is not known here; known: {}", value, fmt::join(known, ", ")),
              "the file was written for another version of rotorloop", "use a matching rotorloop, or convert the file");
}

namespace {

// `key` of `table` is none that the reader knows; `near`: the one that was meant, if any.
[[noreturn]] void refuse_key(const std::filesystem::path& path, const toml::node& node, const std::string& name, const std::string& near) {
  throw Error({position(path, node.source()), at_column(fmt::format("unknown key \"{}\"", name), node.source()),
               near.empty() ? "a misspelt name, or a key of another file type" : fmt::format("\"{}\" was meant", near),
               near.empty() ? "remove it or correct the name (docs/files.md lists all keys)"
                            : fmt::format("write {}, or remove it (docs/files.md lists all keys)", near)});
}

}  // namespace

void TomlFile::refuse_unknown_keys() const {
  const toml::node* first = nullptr;
  const toml::table* holder = nullptr;
  std::string first_name, first_key;
  auto visit = [&](auto&& self, const toml::table& table, const std::string& prefix) -> void {
    for (const auto& [key, node] : table) {
      const std::string name = prefix + std::string(key.str());
      if (!impl_->asked.contains(&node)) {
        if (!first || key.source().begin.line < first->source().begin.line) {
          first = &node;
          holder = &table;
          first_name = name;
          first_key = key.str();
        }
      } else if (const auto* sub = node.as_table()) {
        self(self, *sub, name + ".");
      } else if (const auto* array = node.as_array()) {
        for (const auto& item : *array)
          if (const auto* sub_table = item.as_table(); sub_table && impl_->asked.contains(&item)) self(self, *sub_table, name + ".");
      }
    }
  };
  visit(visit, impl_->root, "");
  if (first) refuse_key(impl_->path, *first, first_name, nearest(first_key, impl_->known[holder]));
}

namespace {
const toml::node* find(const void* node, std::string_view key) { return as_table(node).get(key); }
std::string dotted(const std::string& prefix, std::string_view key) {
  return prefix.empty() ? std::string(key) : prefix + "." + std::string(key);
}
}  // namespace

std::string TomlTable::where() const { return position(file_->path, as_table(node_).source()); }
std::string TomlTable::where(std::string_view key) const {
  const auto* n = find(node_, key);
  return n ? position(file_->path, n->source()) : where();
}

void TomlTable::fail(std::string_view key, std::string what, std::string likely, std::string remedy) const {
  const auto* n = as_table(node_).get(key);
  throw Error({where(key), at_column(std::move(what), (n ? *n : as_table(node_)).source()), std::move(likely), std::move(remedy)});
}

namespace {
// `key` is not in the table: throws where it stands there under a misspelt name.
template <class File>
void refuse_slip_of(const void* node, const std::string& name, const File& file, std::string_view key) {
  for (const auto& [other, value] : as_table(node))
    if (!file.asked.contains(&value) && slip_of_key(other.str(), key))
      refuse_key(file.path, value, dotted(name, other.str()), std::string(key));
}

// The node of `key`, marked as asked for. Throws when it is missing; where it is there under a misspelt name, about that name.
template <class File>
const toml::node& need(const TomlTable& t, const void* node, const std::string& name, File& file, std::string_view key,
                       std::string_view expected) {
  file.known[node].emplace_back(key);
  const toml::node* n = find(node, key);
  if (!n) {
    refuse_slip_of(node, name, file, key);
    throw Error({t.where(), at_column(fmt::format("key \"{}\" is missing", dotted(name, key)), as_table(node).source()),
                 name.empty() ? "the file is of another kind, or the key was forgotten" : "", fmt::format("add {} = {}", key, expected)});
  }
  file.asked.insert(n);
  return *n;
}

[[noreturn]] void wrong_type(const TomlTable& t, const toml::node& n, const std::string& name, std::string_view key,
                             std::string_view expected) {
  t.fail(key, fmt::format("{} = {} is {}, expected {}", dotted(name, key), value_text(n), type_name(n), expected), "",
         fmt::format("write {} as {}", key, expected));
}

double checked(const TomlTable& t, const toml::node& n, const std::string& name, std::string_view key, const Range& range) {
  if (!n.is_number()) wrong_type(t, n, name, key, fmt::format("a number in {}", range.unit == "1" ? "no unit" : range.unit));
  const double v = *n.value<double>();
  const std::string unit = range.unit == "1" ? "" : " " + std::string(range.unit);
  if (!std::isfinite(v) || v < range.min || v > range.max)
    t.fail(key, fmt::format("{} = {}{} is outside {}", dotted(name, key), number_text(v), unit, range_text(range)),
           "another unit than the key's name says, or a slipped digit",
           fmt::format("give {} in {} within {}", key, range.unit == "1" ? "no unit" : range.unit, range_text(range)));
  return v;
}
}  // namespace

double TomlTable::number(std::string_view key, Range range) const {
  const auto& n = need(*this, node_, name_, *file_, key, fmt::format("a number, {}", range_text(range)));
  return checked(*this, n, name_, key, range);
}
double TomlTable::number(std::string_view key, Range range, double fallback) const { return has(key) ? number(key, range) : fallback; }

std::int64_t TomlTable::integer(std::string_view key, std::int64_t min, std::int64_t max) const {
  const auto& n = need(*this, node_, name_, *file_, key, fmt::format("an integer, {} to {}", min, max));
  if (!n.is_integer()) wrong_type(*this, n, name_, key, "an integer");
  const auto v = *n.value<std::int64_t>();
  if (v < min || v > max)
    fail(key, fmt::format("{} = {} is outside {} to {}", dotted(name_, key), v, min, max), "",
         fmt::format("give {} within {} to {}", key, min, max));
  return v;
}
std::int64_t TomlTable::integer(std::string_view key, std::int64_t min, std::int64_t max, std::int64_t fallback) const {
  return has(key) ? integer(key, min, max) : fallback;
}

bool TomlTable::boolean(std::string_view key) const {
  const auto& n = need(*this, node_, name_, *file_, key, "true or false");
  if (!n.is_boolean()) wrong_type(*this, n, name_, key, "true or false");
  return *n.value<bool>();
}
bool TomlTable::boolean(std::string_view key, bool fallback) const { return has(key) ? boolean(key) : fallback; }

std::string TomlTable::text(std::string_view key) const {
  const auto& n = need(*this, node_, name_, *file_, key, "a text in quotes");
  if (!n.is_string()) wrong_type(*this, n, name_, key, "a text in quotes");
  return *n.value<std::string>();
}
std::string TomlTable::text(std::string_view key, std::string_view fallback) const { return has(key) ? text(key) : std::string(fallback); }

std::string TomlTable::choice(std::string_view key, std::initializer_list<std::string_view> words) const {
  const std::string v = text(key);
  if (std::find(words.begin(), words.end(), v) == words.end())
    fail(key, fmt::format("{} = \"{}\" is not known", dotted(name_, key), v), "",
         fmt::format("{}use one of: {}", did_you_mean(v, {words.begin(), words.end()}), fmt::join(words, ", ")));
  return v;
}
std::string TomlTable::choice(std::string_view key, std::initializer_list<std::string_view> words, std::string_view fallback) const {
  return has(key) ? choice(key, words) : std::string(fallback);
}

std::filesystem::path TomlTable::file(std::string_view key) const {
  const std::filesystem::path given = text(key);
  const auto path = (given.is_absolute() ? given : file_->path.parent_path() / given).lexically_normal();
  std::error_code ec;
  if (!std::filesystem::is_regular_file(path, ec))
    fail(key, fmt::format("{} = \"{}\": no such file ({})", dotted(name_, key), given.generic_string(), path.generic_string()), "",
         "correct the path; it is taken relative to the folder of this file");
  return path;
}

std::vector<double> TomlTable::numbers(std::string_view key, std::size_t count, Range range) const {
  const std::string expected =
      count ? fmt::format("an array of {} numbers in {}", count, range.unit) : fmt::format("an array of numbers in {}", range.unit);
  const auto& n = need(*this, node_, name_, *file_, key, expected);
  const auto* array = n.as_array();
  if (!array) wrong_type(*this, n, name_, key, expected);
  if ((count && array->size() != count) || array->empty())
    fail(key, fmt::format("{} has {} values, expected {}", dotted(name_, key), array->size(), count ? std::to_string(count) : "at least 1"),
         "", fmt::format("give {}", expected));
  std::vector<double> out;
  for (const auto& item : *array) out.push_back(checked(*this, item, name_, key, range));
  return out;
}

std::vector<std::string> TomlTable::texts(std::string_view key) const {
  const auto& n = need(*this, node_, name_, *file_, key, "an array of texts");
  const auto* array = n.as_array();
  if (!array) wrong_type(*this, n, name_, key, "an array of texts");
  std::vector<std::string> out;
  for (const auto& item : *array) {
    if (!item.is_string()) wrong_type(*this, item, name_, key, "an array of texts");
    out.push_back(*item.value<std::string>());
  }
  return out;
}

std::vector<std::int64_t> TomlTable::integers(std::string_view key, std::int64_t min, std::int64_t max) const {
  const auto& n = need(*this, node_, name_, *file_, key, "an array of integers");
  const auto* array = n.as_array();
  if (!array) wrong_type(*this, n, name_, key, "an array of integers");
  std::vector<std::int64_t> out;
  for (const auto& item : *array) {
    if (!item.is_integer()) wrong_type(*this, item, name_, key, "an array of integers");
    const auto v = *item.value<std::int64_t>();
    if (v < min || v > max)
      fail(key, fmt::format("{} has {}, outside {} to {}", dotted(name_, key), v, min, max), "",
           fmt::format("give integers within {} to {}", min, max));
    out.push_back(v);
  }
  return out;
}

bool TomlTable::has(std::string_view key) const {
  file_->known[node_].emplace_back(key);
  return find(node_, key) != nullptr;
}
bool TomlTable::is_array(std::string_view key) const {
  const auto* n = find(node_, key);
  return n && n->is_array();
}

TomlTable TomlTable::table(std::string_view key) const {
  const auto& n = need(*this, node_, name_, *file_, key, "{ … }");
  if (!n.is_table()) wrong_type(*this, n, name_, key, "a table");
  return TomlTable(n.as_table(), dotted(name_, key), file_);
}
std::optional<TomlTable> TomlTable::optional_table(std::string_view key) const {
  if (!has(key)) return std::nullopt;
  return table(key);
}

std::vector<TomlTable> TomlTable::tables(std::string_view key, std::size_t min_count, std::size_t max_count) const {
  std::vector<TomlTable> out;
  const auto count_error = [&](std::size_t n) {
    fail(key,
         fmt::format("[[{}]] occurs {} times, expected {}", dotted(name_, key), n,
                     min_count == max_count ? std::to_string(min_count) : fmt::format("{} to {}", min_count, max_count)),
         name_.empty() && n == 0 ? "the file is of another kind" : "", fmt::format("write one [[{}]] block for each", dotted(name_, key)));
  };
  file_->known[node_].emplace_back(key);
  const auto* n = find(node_, key);
  if (!n) {
    if (min_count > 0) {
      refuse_slip_of(node_, name_, *file_, key);
      count_error(0);
    }
    return out;
  }
  file_->asked.insert(n);
  const auto* array = n->as_array();
  if (!array) wrong_type(*this, *n, name_, key, "an array of tables");
  for (const auto& item : *array) {
    if (!item.is_table()) wrong_type(*this, item, name_, key, "an array of tables");
    file_->asked.insert(&item);
    out.push_back(TomlTable(item.as_table(), fmt::format("{}[{}]", dotted(name_, key), out.size() + 1), file_));
  }
  if (out.size() < min_count || out.size() > max_count) count_error(out.size());
  return out;
}

std::vector<std::string> TomlTable::keys() const {
  std::vector<std::pair<toml::source_position, std::string>> found;
  for (const auto& [key, node] : as_table(node_)) found.emplace_back(key.source().begin, std::string(key.str()));
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> out;
  for (auto& f : found) out.push_back(std::move(f.second));
  return out;
}

void TomlTable::accept_all() const {
  auto visit = [&](auto&& self, const toml::node& node) -> void {
    file_->asked.insert(&node);
    if (const auto* t = node.as_table())
      for (const auto& [k, v] : *t) self(self, v);
    if (const auto* a = node.as_array())
      for (const auto& v : *a) self(self, v);
  };
  for (const auto& [k, v] : as_table(node_)) visit(visit, v);
}

}  // namespace rotorloop
