// Reads DataFlash logs, ArduPilot's .BIN (libraries/AP_Logger/README.md and LogStructure.h of ArduPilot): a file that describes its own
// messages. What is damaged is left out and noted, never guessed; memory stays proportional to the file whatever its bytes claim.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bench/sysid/log/column_table.hpp"

namespace rotorloop::log {

inline constexpr std::string_view kDataFlashHead{"\xA3\x95", 2};  // of every message

struct DataFlashField {
  std::string name;
  char type = 0;           // the format's letter: 'f' float, 'c' int16 of hundredths, …
  std::size_t offset = 0;  // from the begin of the message
  std::string unit;        // by the log's own FMTU, UNIT and MULT: "rpm", "0.001 Ah"; empty where it says none
};

struct DataFlashMessage {
  std::string name;  // "ATT"
  std::size_t bytes = 0;
  std::vector<DataFlashField> fields;
  std::optional<std::size_t> instance;  // index of the field that distinguishes sensors or motors of one kind
  std::vector<std::size_t> at;          // begin of each in the file
};

class DataFlash {
 public:
  // Throws Error (ExitCode::data_quality) when `bytes` hold no message that can be read. Everything else is tolerated and reported in
  // notes().
  static DataFlash parse(std::string bytes, const std::filesystem::path& name_for_errors);

  const std::vector<DataFlashMessage>& messages() const { return messages_; }  // those that the log has any of
  const std::vector<std::string>& notes() const { return notes_; }
  std::set<int> instances(const DataFlashMessage& message) const;

  // One row for each message `name` of that instance, or for each message where they have none. Columns as logged, hundredths (c, C, e, E)
  // and latitudes (L) as numbers of their unit; TimeUS in µs, also where the log has TimeMS. Besides the fields:
  // "RPM[2]": the field of instance 2. A row then holds one round of all instances, those within 2 ms, whatever `instance` is; messages
  //   of old logs that are numbered (ESC1 to ESC4) count as instances 0 to 3 of the name without number.
  // "Lat[m]", "Lng[m]": metres north and east of the first reading; not-a-number where both are 0, which is no fix.
  // Nothing when the log has no such message.
  std::optional<ColumnTable> table(const std::string& name, int instance, const std::set<std::string>& wanted) const;

 private:
  void scan();
  std::size_t next_head(std::size_t from) const;
  void read_format(std::size_t at);
  void apply_units();
  const DataFlashMessage* find(std::string_view name) const;
  std::optional<std::vector<double>> column(const DataFlashMessage& m, const std::vector<std::size_t>& rows, std::string_view field) const;
  std::vector<std::size_t> rows_of(const DataFlashMessage& m, int instance) const;
  std::optional<ColumnTable> rounds(const std::string& name, const std::set<std::string>& wanted) const;
  double number(std::size_t at, char type) const;
  std::uint64_t integer(std::size_t at, std::size_t size) const;
  std::string text(std::size_t at, std::size_t size) const;

  std::string bytes_;
  std::map<std::uint8_t, DataFlashMessage> formats_;
  std::vector<DataFlashMessage> messages_;
  std::vector<std::string> notes_;
  std::size_t skipped_ = 0, unknown_ = 0, bad_formats_ = 0;
};

}  // namespace rotorloop::log
