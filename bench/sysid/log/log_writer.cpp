#include "bench/sysid/log/log_writer.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>

#include "host/base/error.hpp"

namespace rotorloop::log {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
constexpr std::array<double, 10> kScale{1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
constexpr std::array<std::uint64_t, 10> kPower{1, 10, 100, 1'000, 10'000, 100'000, 1'000'000, 10'000'000, 100'000'000, 1'000'000'000};
constexpr double kLargestScaled = 1e15;  // below 2^53: the scaled value still has its last digit

// "00" to "99": two digits for one division.
constexpr auto kDigitPairs = [] {
  std::array<std::array<char, 2>, 100> pairs{};
  for (std::size_t i = 0; i < 100; ++i) pairs[i] = {static_cast<char>('0' + i / 10), static_cast<char>('0' + i % 10)};
  return pairs;
}();

[[noreturn]] void cannot_write(const std::filesystem::path& path, int error) {
  throw Error({path.generic_string(), std::string("cannot be written: ") + std::strerror(error), error == ENOSPC ? "the disk is full" : "",
               "free space or choose another folder with --out"},
              ExitCode::device);
}

// The header row from the visitor of the columns.
struct NameVisitor {
  std::string text;
  void add(const std::string& name, const char* unit) {
    if (!text.empty()) text += ',';
    text += name + '[' + unit + ']';
  }
  void one(const char* n, const char* u, int, double) { add(n, u); }
  void many(const char* n, const char* u, std::initializer_list<const char*> ends) {
    for (const auto* e : ends) add(std::string(n) + '_' + e, u);
  }
  void xyz(const char* n, const char* u, int, const Cells3&) { many(n, u, {"x", "y", "z"}); }
  void wxyz(const char* n, const char* u, int, const Cells4&) { many(n, u, {"w", "x", "y", "z"}); }
  void rotors(const char* n, const char* u, int, const Cells4&) { many(n, u, {"1", "2", "3", "4"}); }
};

// One row: every cell followed by a comma; the last comma becomes the line feed.
struct CellVisitor {
  char* out;
  void one(const char*, const char*, int decimals, double v) {
    out = write_fixed(out, v, decimals);
    *out++ = ',';
  }
  template <std::size_t N>
  void all(int decimals, const std::array<double, N>& v) {
    for (const double x : v) one("", "", decimals, x);
  }
  void xyz(const char*, const char*, int d, const Cells3& v) { all(d, v); }
  void wxyz(const char*, const char*, int d, const Cells4& v) { all(d, v); }
  void rotors(const char*, const char*, int d, const Cells4& v) { all(d, v); }
};

std::string flight_names() {
  NameVisitor v;
  const FlightRow row;
  visit_flight_columns(row, v);
  return v.text;
}
std::string truth_names() {
  NameVisitor v;
  const TruthRow row;
  visit_truth_columns(row, v);
  return v.text;
}

// Digits of v, at least one.
char* write_digits(char* out, std::uint64_t v) {
  char reversed[20];
  int n = 0;
  do {
    reversed[n++] = static_cast<char>('0' + v % 10);
    v /= 10;
  } while (v != 0);
  while (n > 0) *out++ = reversed[--n];
  return out;
}

}  // namespace

char* write_fixed(char* out, double value, int decimals) {
  if (std::isnan(value)) return out;
  const auto d = static_cast<std::size_t>(decimals);
  const double scaled = value * kScale[d];
  if (!(scaled < kLargestScaled && scaled > -kLargestScaled)) return std::to_chars(out, out + 32, value).ptr;
  const bool negative = scaled < 0;
  const auto n = static_cast<std::uint64_t>((negative ? -scaled : scaled) + 0.5);
  if (n == 0) {
    *out++ = '0';
    return out;
  }
  if (negative) *out++ = '-';
  const std::uint64_t whole = n / kPower[d];
  auto fraction = static_cast<std::uint32_t>(n - whole * kPower[d]);
  out = write_digits(out, whole);
  if (fraction == 0) return out;
  *out++ = '.';
  char* end = out + decimals;
  char* p = end;
  for (; p - out >= 2; fraction /= 100) std::memcpy(p -= 2, kDigitPairs[fraction % 100].data(), 2);
  if (p != out) *out = static_cast<char>('0' + fraction);
  while (end[-1] == '0') --end;  // not all are: the fraction is not zero
  return end;
}

CsvWriter::CsvWriter(const std::filesystem::path& path, std::string_view first_line, const LogHeader& header, const std::string& columns)
    : path_(path), buffer_(kBufferBytes) {
  file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file_ < 0) cannot_write(path_, errno);
  std::string text = "# " + std::string(first_line) + "\n";
  for (const auto& [key, value] : header) text += "# " + key + ": " + value + "\n";
  text += columns + "\n";
  if (text.size() > buffer_.size() - kRowBytes) buffer_.resize(text.size() + kRowBytes);
  std::memcpy(buffer_.data(), text.data(), text.size());
  fill_ = text.size();
  bytes_ = text.size();
}

CsvWriter::~CsvWriter() {
  if (file_ < 0) return;
  try {
    close();
  } catch (const Error&) {
    // The caller that cares about a full disk calls close(); a destructor cannot report it.
  }
}

char* CsvWriter::begin_row() {
  if (buffer_.size() - fill_ < kRowBytes) flush();
  return buffer_.data() + fill_;
}

void CsvWriter::end_row(char* end) {
  const auto fill = static_cast<std::size_t>(end - buffer_.data());
  bytes_ += fill - fill_;
  fill_ = fill;
}

void CsvWriter::flush() {
  hash_.add({buffer_.data(), fill_});
  for (std::size_t done = 0; done < fill_;) {
    const auto n = ::write(file_, buffer_.data() + done, fill_ - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) cannot_write(path_, errno);
    done += static_cast<std::size_t>(n);
  }
  fill_ = 0;
}

std::string CsvWriter::close() {
  const int file = file_;
  try {
    flush();
  } catch (...) {
    file_ = -1;
    ::close(file);
    throw;
  }
  file_ = -1;
  if (::close(file) != 0) cannot_write(path_, errno);
  return hash_.hex();
}

FlightLogWriter::FlightLogWriter(const std::filesystem::path& path, const LogHeader& header)
    : CsvWriter(path, "rotorloop flight log 1", header, flight_names()) {}
void FlightLogWriter::write(const FlightRow& row) {
  CellVisitor v{begin_row()};
  visit_flight_columns(row, v);
  v.out[-1] = '\n';
  end_row(v.out);
}

TruthLogWriter::TruthLogWriter(const std::filesystem::path& path, const LogHeader& header)
    : CsvWriter(path, "rotorloop truth log 1", header, truth_names()) {}
void TruthLogWriter::write(const TruthRow& row) {
  CellVisitor v{begin_row()};
  visit_truth_columns(row, v);
  v.out[-1] = '\n';
  end_row(v.out);
}

}  // namespace rotorloop::log
