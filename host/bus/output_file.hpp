// A file written in large blocks by recorders: appending a record costs a copy. Errors of the disk (full, gone) surface at the
// block that hits them, with the path and the system's reason, and at close().
#pragma once
#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>

namespace rotorloop {

class OutputFile {
 public:
  static constexpr std::size_t kBlockBytes = std::size_t{1} << 16;
  static constexpr std::size_t kMaxRecordBytes = 256;

  explicit OutputFile(std::string path);  // throws Error (exit 3) if it cannot be created
  ~OutputFile();                          // writes what is left; call close() to learn whether that worked
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  // Room for one record of at most kMaxRecordBytes; commit() says how many bytes of it were used.
  char* reserve() {
    if (used_ + kMaxRecordBytes > kBlockBytes) flush();
    return buffer_.get() + used_;
  }
  void commit(std::size_t bytes) { used_ += bytes; }
  void flush();  // throws Error (exit 3)
  void close();  // flush and close; throws Error (exit 3); a second call does nothing
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  std::unique_ptr<char[]> buffer_;
  std::size_t used_ = 0;
  std::FILE* file_ = nullptr;
};

}  // namespace rotorloop
