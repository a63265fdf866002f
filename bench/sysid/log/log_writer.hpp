// Writes flight.csv and truth.csv fast enough to log every controller step (budget 8 µs a row): own fixed-point formatting
// into a large buffer, hashed on the way out. The same rows always give the same bytes. Not part of the control loop
// proper: a full disk throws.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bench/sysid/log/flight_columns.hpp"
#include "host/base/sha256.hpp"

namespace rotorloop::log {

// Writes `value` rounded to `decimals` (0..9) digits behind the point, half away from zero, without trailing zeros ("0" for
// both zeros); nothing for not-a-number. Beyond 1e15 / 10^decimals the shortest exact text is written. Needs 32 bytes.
char* write_fixed(char* out, double value, int decimals);

// `# key: value` lines, in the order given.
using LogHeader = std::vector<std::pair<std::string, std::string>>;

// One CSV file. Base of the two below.
class CsvWriter {
 public:
  CsvWriter(const CsvWriter&) = delete;
  CsvWriter& operator=(const CsvWriter&) = delete;
  ~CsvWriter();
  // Flushes and closes; returns the SHA-256 of the file. Call once; the destructor closes without hash if it was not.
  std::string close();
  // On disk from here on: of a process that may be killed. Throws Error when the disk refused.
  void flush();
  std::uint64_t bytes() const { return bytes_; }

 protected:
  // Throws Error (ExitCode::device) when the file cannot be made.
  CsvWriter(const std::filesystem::path& path, std::string_view first_line, const LogHeader& header, const std::string& columns);
  // Room for one row; flushes first when the buffer is short of it.
  char* begin_row();
  void end_row(char* end);
  static constexpr std::size_t kRowBytes = 4096;

 private:
  std::filesystem::path path_;
  int file_ = -1;
  std::vector<char> buffer_;
  std::size_t fill_ = 0;
  std::uint64_t bytes_ = 0;
  Sha256 hash_;
};

// Header keys that readers of flight.csv expect: vehicle, pole_pairs, start_utc, source; see docs/files.md.
class FlightLogWriter : public CsvWriter {
 public:
  FlightLogWriter(const std::filesystem::path& path, const LogHeader& header);
  void write(const FlightRow& row);
};

class TruthLogWriter : public CsvWriter {
 public:
  TruthLogWriter(const std::filesystem::path& path, const LogHeader& header);
  void write(const TruthRow& row);
};

// start_utc of a lockstep run: virtual time counts from here, never from the wall clock.
inline constexpr std::string_view kVirtualEpochUtc = "1970-01-01T00:00:00Z";

}  // namespace rotorloop::log
