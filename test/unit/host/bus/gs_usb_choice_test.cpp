// Which gs_usb adapter a name means: the kernel's tree of USB devices as files, names, and every refusal in its own words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>

#include "host/bus/live/gs_usb/adapter_choice.hpp"
#include "host/bus/live/gs_usb/usb_tree.hpp"

namespace rotorloop::gs_usb {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string refused_text(const std::function<void()>& action, ExitCode code) {
  try {
    action();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), code) << e.what();
    return e.what();
  }
  return "nothing was refused";
}

// A tree as /sys/bus/usb/devices has it.
class Tree {
 public:
  Tree()
      : root_(fs::temp_directory_path() / ("rotorloop_usb_tree_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) + "_" +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  ~Tree() { fs::remove_all(root_); }
  Tree(const Tree&) = delete;
  Tree& operator=(const Tree&) = delete;
  void write(const std::string& path, const std::string& text) {
    fs::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << text << "\n";
  }
  void adapter(const std::string& path, const std::string& serial, const std::string& interface = "00") {
    write(path + "/idVendor", "1d50");
    write(path + "/idProduct", "606f");
    write(path + "/busnum", "1");
    write(path + "/devnum", "7");
    if (!serial.empty()) write(path + "/serial", serial);
    const std::string i = path + "/" + path + ":1." + interface.substr(1);
    write(i + "/bInterfaceNumber", interface);
    write(i + "/bInterfaceClass", "ff");
    write(i + "/ep_81/bEndpointAddress", "81");
    write(i + "/ep_81/bmAttributes", "02");
    write(i + "/ep_02/bEndpointAddress", "02");
    write(i + "/ep_02/bmAttributes", "02");
  }
  const fs::path& root() const { return root_; }

 private:
  fs::path root_;
};

TEST(GsUsbTree, TellsSerialPlaceEndpointsDriverAndInterfaces) {
  Tree t;
  t.adapter("1-1.2", "0042001A", "01");
  t.write("1-1.2/product", "candleLight USB to CAN adapter");
  t.write("1-1.2/1-1.2:1.0/bInterfaceNumber", "00");
  t.write("1-1.2/1-1.2:1.0/bInterfaceClass", "fe");  // firmware update
  t.write("1-1.2/1-1.2:1.1/net/can0/flags", "0x40081");
  t.write("1-1.2/1-1.2:1.1/net/can1/flags", "0x40080");
  fs::create_directories(t.root() / "drivers/gs_usb");
  fs::create_symlink(t.root() / "drivers/gs_usb", t.root() / "1-1.2/1-1.2:1.1/driver");
  const auto found = plugged_in(t.root());
  ASSERT_EQ(found.size(), 1u);
  const UsbAdapter& a = found.front();
  EXPECT_EQ(a.name(), "0042001A");
  EXPECT_EQ(a.path, "1-1.2");
  EXPECT_EQ(a.product_name, "candleLight USB to CAN adapter");
  EXPECT_EQ(a.interface, 1u) << "the one with endpoints, not the first";
  EXPECT_EQ(a.endpoint_in, 0x81);
  EXPECT_EQ(a.endpoint_out, 0x02);
  EXPECT_EQ(a.user_text(), "kernel driver gs_usb: can0 (up), can1");
}

TEST(GsUsbTree, LeavesOutOtherDevicesAndSuchWithGarbageInTheirDescriptors) {
  Tree t;
  t.write("usb1/idVendor", "1d6b");
  t.adapter("1-1", "A");
  t.write("1-1/idProduct", "0002");
  t.adapter("1-2", "B");
  t.write("1-2/1-2:1.0/bInterfaceClass", "03");
  t.adapter("1-3", "C");
  t.write("1-3/1-3:1.0/ep_02/bmAttributes", "03");
  t.adapter("1-4", "D");
  t.write("1-4/1-4:1.0/bInterfaceNumber", "");
  t.adapter("1-5", "E");
  t.write("1-5/devnum", "many");
  t.adapter("1-6", "F");
  t.write("1-6/1-6:1.0/ep_81/bEndpointAddress", "ffff");
  t.adapter("1-7", "");
  const auto found = plugged_in(t.root());
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found.front().name(), "1-7") << "without a serial number it is named by its port";
  EXPECT_EQ(found.front().user_text(), "nobody");
  EXPECT_TRUE(plugged_in(t.root() / "no_such_folder").empty());
}

TEST(GsUsbTree, KnowsTheAdaptersThatTheUdevRuleNames) {
  std::ifstream in(std::string(ROTORLOOP_SOURCE_DIR) + "/host/bus/live/gs_usb/" + kUdevRule);
  std::stringstream rule;
  rule << in.rdbuf();
  for (const auto& [vendor, product] : kKnownAdapters) {
    char line[64];
    std::snprintf(line, sizeof line, "ATTR{idVendor}==\"%04x\", ATTR{idProduct}==\"%04x\"", vendor, product);
    EXPECT_THAT(rule.str(), HasSubstr(line));
  }
}

TEST(GsUsbName, HasSerialChannelAndRatesEachOfWhichMayBeLeftOut) {
  const Settings none = parse_settings("", "bus"), all = parse_settings("0042001A/1@500000,2000000", "bus"),
                 rates = parse_settings("@250000", "bus");
  EXPECT_EQ(none.adapter, "");
  EXPECT_EQ(none.channel, 0u);
  EXPECT_EQ(none.bit_rate_Hz, 1'000'000u) << "of DroneCAN";
  EXPECT_FALSE(none.data_rate_Hz);
  EXPECT_EQ(all.adapter, "0042001A");
  EXPECT_EQ(all.channel, 1u);
  EXPECT_EQ(all.bit_rate_Hz, 500'000u);
  EXPECT_EQ(all.data_rate_Hz, 2'000'000u);
  EXPECT_EQ(all.name(), "gsusb:0042001A/1");
  EXPECT_EQ(rates.bit_rate_Hz, 250'000u);
  EXPECT_EQ(parse_settings("/1", "bus").channel, 1u);
}

TEST(GsUsbName, ThatCannotBeOneIsRefused) {
  const auto text = [](const char* name) { return refused_text([&] { parse_settings(name, "--bus"); }, ExitCode::usage); };
  EXPECT_THAT(text("A/two"), AllOf(HasSubstr("--bus: error: channel \"two\" is out of range: 0 to 15"), HasSubstr("write gsusb:")));
  EXPECT_THAT(text("A/16"), HasSubstr("0 to 15"));
  EXPECT_THAT(text("A/"), HasSubstr("channel \"\""));
  EXPECT_THAT(text("A@fast"), HasSubstr("bit rate \"fast\" is out of range: 10000 to 1000000"));
  EXPECT_THAT(text("A@"), HasSubstr("bit rate \"\""));
  EXPECT_THAT(text("A@1000000,9000000"), HasSubstr("10000 to 8000000"));
  EXPECT_THAT(text("A B"), HasSubstr("cannot be the serial number"));
}

UsbAdapter adapter(const char* path, const char* serial) {
  UsbAdapter a;
  a.path = path;
  a.serial = serial;
  return a;
}

TEST(GsUsbChoice, TakesTheOnlyOneOrTheNamedOneBySerialOrPort) {
  const std::vector<UsbAdapter> two{adapter("1-1", "A"), adapter("1-2", "B")};
  EXPECT_EQ(choose_adapter(parse_settings("", ""), std::span(two).first(1)).path, "1-1");
  EXPECT_EQ(choose_adapter(parse_settings("B", ""), two).path, "1-2");
  EXPECT_EQ(choose_adapter(parse_settings("1-2/1", ""), two).path, "1-2");
}

TEST(GsUsbChoice, RefusesWhatIsNotThereAmbiguousOrUsedAndSaysWhatToDo) {
  const auto text = [](const char* name, std::vector<UsbAdapter> there) {
    return refused_text([&] { choose_adapter(parse_settings(name, ""), there); }, ExitCode::device);
  };
  EXPECT_THAT(text("", {}), AllOf(HasSubstr("gsusb:: error: no gs_usb adapter is plugged in"), HasSubstr("lsusb")));
  EXPECT_THAT(text("C", {adapter("1-1", "A"), adapter("1-2", "B")}), HasSubstr("there are: gsusb:A, gsusb:B"));
  EXPECT_THAT(text("", {adapter("1-1", "A"), adapter("1-2", "")}),
              AllOf(HasSubstr("several adapters are plugged in: gsusb:A, gsusb:1-2"), HasSubstr("name one")));
  EXPECT_THAT(text("A", {adapter("1-1", "A"), adapter("1-2", "A")}), HasSubstr("name one by its port: gsusb:1-1 or gsusb:1-2"));
  UsbAdapter busy = adapter("1-1", "A");
  busy.driver = "gs_usb";
  busy.interfaces = {"can0"};
  EXPECT_EQ(choose_adapter(parse_settings("A", ""), {&busy, 1}).path, "1-1") << "the kernel's driver has it, and nobody uses that";
  busy.up = {"can0"};
  EXPECT_THAT(text("A", {busy}),
              AllOf(HasSubstr("has this adapter as can0, which is up"), HasSubstr("socketcan:can0"), HasSubstr("ip link set can0 down")));
}

TEST(GsUsbChoice, ThatCannotBeOpenedSaysWhy) {
  const Settings s = parse_settings("A", "");
  EXPECT_THAT(open_refusal(s, UsbStatus::no_permission, "").what(), AllOf(HasSubstr("no permission"), HasSubstr(kUdevRule)));
  EXPECT_THAT(open_refusal(s, UsbStatus::busy, "python3 (412)").what(), HasSubstr("another program uses the adapter: python3 (412)"));
  EXPECT_THAT(open_refusal(s, UsbStatus::gone, "").what(), HasSubstr("plug it in again"));
  EXPECT_EQ(open_refusal(s, UsbStatus::gone, "").exit_code(), ExitCode::device);
}

}  // namespace
}  // namespace rotorloop::gs_usb
