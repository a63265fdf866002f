// Files over the bus, and the request that starts a firmware update (docs/wire.md §2).
#pragma once
#include <cstddef>
#include <cstdint>

#include "protocols/dsdl.hpp"
#include "protocols/transfer.hpp"

namespace rotorloop::protocols {

struct FilePath {
  static constexpr const char* kName = "uavcan.protocol.file.Path";
  static constexpr std::size_t kMostBytes = 200;
  Text<kMostBytes> path{};
  constexpr FilePath() = default;
  constexpr FilePath(const char* text) : path(text) {}  // implicit: a path is given as a literal
  friend constexpr bool operator==(const FilePath&, const FilePath&) = default;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.tail("path", u(8), v.path.items, v.path.count);
  }
};

struct FileError {
  static constexpr const char* kName = "uavcan.protocol.file.Error";
  static constexpr std::int16_t kOk = 0, kNotFound = 2, kIo = 5, kAccessDenied = 13, kIsDirectory = 21, kInvalid = 22, kTooLarge = 27,
                                kOutOfSpace = 28, kNotImplemented = 38, kUnknown = 32767;
  std::int16_t value = kOk;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("value", i(16), v.value);
  }
};

struct EntryType {
  static constexpr const char* kName = "uavcan.protocol.file.EntryType";
  static constexpr std::uint8_t kFile = 1, kDirectory = 2, kLink = 4, kReadable = 8, kWriteable = 16;
  std::uint8_t flags = 0;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("flags", u(8), v.flags);
  }
};

struct BeginFirmwareUpdate {
  static constexpr DataType kType{.service = true, .id = 40, .signature = 0xB7D725DF72724126};
  static constexpr const char* kName = "uavcan.protocol.file.BeginFirmwareUpdate";
  std::uint8_t source_node_id = 0;  // file server; 0: the caller
  FilePath path{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("source_node_id", u(8), v.source_node_id);
    f.nested_tail("image_file_remote_path", v.path);
  }
};

struct BeginFirmwareUpdateResponse {
  static constexpr DataType kType = BeginFirmwareUpdate::kType;
  static constexpr const char* kName = BeginFirmwareUpdate::kName;
  enum class Error : std::uint8_t { ok = 0, invalid_mode = 1, in_progress = 2, unknown = 255 };
  Error error = Error::ok;
  Text<127> message{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("error", u(8), v.error);
    f.tail("optional_error_message", u(8), v.message.items, v.message.count);
  }
};

struct FileGetInfo {
  static constexpr DataType kType{.service = true, .id = 45, .signature = 0x5004891EE8A27531};
  static constexpr const char* kName = "uavcan.protocol.file.GetInfo";
  FilePath path{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested_tail("path", v.path);
  }
};

struct FileGetInfoResponse {
  static constexpr DataType kType = FileGetInfo::kType;
  static constexpr const char* kName = FileGetInfo::kName;
  std::uint64_t size = 0;  // 40 bits
  FileError error{};
  EntryType entry{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("size", u(40), v.size);
    f.nested("error", v.error);
    f.nested_tail("entry_type", v.entry);
  }
};

// Data shorter than kBlock end the file.
struct FileRead {
  static constexpr DataType kType{.service = true, .id = 48, .signature = 0x8DCDCA939F33F678};
  static constexpr const char* kName = "uavcan.protocol.file.Read";
  static constexpr std::size_t kBlock = 256;
  std::uint64_t offset = 0;  // 40 bits
  FilePath path{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("offset", u(40), v.offset);
    f.nested_tail("path", v.path);
  }
};

struct FileReadResponse {
  static constexpr DataType kType = FileRead::kType;
  static constexpr const char* kName = FileRead::kName;
  FileError error{};
  BoundedArray<std::uint8_t, FileRead::kBlock> data{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested("error", v.error);
    f.tail("data", u(8), v.data.items, v.data.count);
  }
};

struct FileWrite {
  static constexpr DataType kType{.service = true, .id = 49, .signature = 0x515AA1DC77E58429};
  static constexpr const char* kName = "uavcan.protocol.file.Write";
  std::uint64_t offset = 0;
  FilePath path{};
  BoundedArray<std::uint8_t, 192> data{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("offset", u(40), v.offset);
    f.nested("path", v.path);
    f.tail("data", u(8), v.data.items, v.data.count);
  }
};

struct FileWriteResponse {
  static constexpr DataType kType = FileWrite::kType;
  static constexpr const char* kName = FileWrite::kName;
  FileError error{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested_tail("error", v.error);
  }
};

struct FileDelete {
  static constexpr DataType kType{.service = true, .id = 47, .signature = 0x78648C99170B47AA};
  static constexpr const char* kName = "uavcan.protocol.file.Delete";
  FilePath path{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested_tail("path", v.path);
  }
};

struct FileDeleteResponse {
  static constexpr DataType kType = FileDelete::kType;
  static constexpr const char* kName = FileDelete::kName;
  FileError error{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested_tail("error", v.error);
  }
};

struct GetDirectoryEntryInfo {
  static constexpr DataType kType{.service = true, .id = 46, .signature = 0x8C46E8AB568BDA79};
  static constexpr const char* kName = "uavcan.protocol.file.GetDirectoryEntryInfo";
  std::uint32_t entry_index = 0;
  FilePath directory{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("entry_index", u(32), v.entry_index);
    f.nested_tail("directory_path", v.directory);
  }
};

struct GetDirectoryEntryInfoResponse {
  static constexpr DataType kType = GetDirectoryEntryInfo::kType;
  static constexpr const char* kName = GetDirectoryEntryInfo::kName;
  FileError error{};
  EntryType entry{};
  FilePath full_path{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested("error", v.error);
    f.nested("entry_type", v.entry);
    f.nested_tail("entry_full_path", v.full_path);
  }
};

}  // namespace rotorloop::protocols
