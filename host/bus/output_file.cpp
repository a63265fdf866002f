// Plain stdio underneath, unbuffered: the block is the buffer.
#include "host/bus/output_file.hpp"

#include <cerrno>
#include <cstring>

#include "host/base/error.hpp"

namespace rotorloop {
namespace {

[[noreturn]] void fail(const std::string& path, const char* what, int reason) {
  throw Error({.where = path,
               .what = std::string(what) + ": " + std::strerror(reason),
               .likely = reason == ENOSPC ? "the disk is full" : "",
               .remedy = reason == ENOSPC ? "free space, or record to another folder" : "check that the folder exists and may be written"},
              ExitCode::device);
}

}  // namespace

OutputFile::OutputFile(std::string path) : path_(std::move(path)), buffer_(std::make_unique<char[]>(kBlockBytes)) {
  file_ = std::fopen(path_.c_str(), "wb");
  if (file_ == nullptr) fail(path_, "cannot create the recording", errno);
  std::setvbuf(file_, nullptr, _IONBF, 0);
}

OutputFile::~OutputFile() {
  if (file_ == nullptr) return;
  std::fwrite(buffer_.get(), 1, used_, file_);
  std::fclose(file_);
}

void OutputFile::flush() {
  if (file_ == nullptr || used_ == 0) return;
  const std::size_t bytes = used_;
  used_ = 0;
  if (std::fwrite(buffer_.get(), 1, bytes, file_) != bytes) fail(path_, "cannot write the recording", errno);
}

void OutputFile::close() {
  if (file_ == nullptr) return;
  flush();
  std::FILE* file = file_;
  file_ = nullptr;
  if (std::fclose(file) != 0) fail(path_, "cannot finish the recording", errno);
}

}  // namespace rotorloop
