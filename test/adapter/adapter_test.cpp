// The line protocol: published values as vectors, casts and float16 at their edges, reassembly, and everything that may be wrong in a line.
#include "test/adapter/adapter.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "test/adapter/json_fields.hpp"

namespace rotorloop {
namespace {

Json ask(const std::string& line) { return Json::parse(adapter_answer(line)); }

// "id#data id#data …"
std::string frames_of(const Json& answer) {
  if (!answer.contains("frames")) return answer.dump();
  std::string text;
  for (const Json& f : answer["frames"])
    text += (text.empty() ? "" : " ") + f["id"].get<std::string>() + "#" + f["data"].get<std::string>();
  return text;
}

std::string encode_line(const std::string& type, const std::string& fields, const std::string& more = R"("kind":"message","source":42)") {
  return R"({"op":"encode","type":")" + type + R"(","fields":)" + fields + "," + more + "}";
}

// Payload of a message in one frame, without its tail byte.
std::string payload(const std::string& type, const std::string& fields) {
  const Json a = ask(encode_line(type, fields));
  if (!a.contains("frames") || a["frames"].size() != 1) return a.dump();
  const std::string data = a["frames"][0]["data"];
  return data.substr(0, data.size() - 2);
}

struct Vector {
  const char* type;
  const char* fields;
  const char* more;
  const char* frames;
};

// Sources: DroneCAN specification (identifier and tail byte, "CAN bus transport layer"; allocation, "Application level functions") and the
// examples of docs/wire.md.
TEST(Adapter, EncodesThePublishedExamples) {
  const Vector vectors[] = {
      {"uavcan.protocol.NodeStatus", R"({"uptime_sec":1234567,"mode":1,"vendor_specific_status_code":48879})",
       R"("kind":"message","priority":20,"source":42)", "1401552a#87d6120008efbec0"},
      {"uavcan.equipment.esc.RawCommand", R"({"cmd":[0,8191,-8192,4096]})",
       R"("kind":"message","priority":7,"source":120,"transfer_id":31)", "07040678#0003fdf0080010df"},
      {"uavcan.equipment.esc.RawCommand", R"({"cmd":[0,9000,-9000,4096]})",  // saturated
       R"("kind":"message","priority":7,"source":120,"transfer_id":31)", "07040678#0003fdf0080010df"},
      {"uavcan.equipment.esc.RPMCommand", R"({"rpm":[8950,8950,9100,-9100]})",
       R"("kind":"message","priority":7,"source":120,"transfer_id":2)", "07040778#48dbf6223d888882 07040778#c231d37362"},
      {"uavcan.protocol.GetNodeInfo", "{}", R"("kind":"request","priority":24,"source":120,"dest":42,"transfer_id":9)", "1801aaf8#c9"},
      {"uavcan.protocol.RestartNode", R"({"magic_number":742196058910})",
       R"("kind":"request","priority":30,"source":127,"dest":42,"transfer_id":0)", "1e05aaff#1e1b55ceacc0"},
      {"uavcan.protocol.dynamic_node_id.Allocation", R"({"first_part_of_unique_id":true,"unique_id":{"hex":"010203040506"}})",
       R"("kind":"anonymous","priority":30,"source":0,"discriminator":6844,"transfer_id":3)", "1e6af100#01010203040506c3"},
      {"uavcan.protocol.dynamic_node_id.Allocation", R"({"node_id":125,"unique_id":{"hex":"0102030405060708090a0b0c0d0e0f10"}})",
       R"("kind":"message","priority":30,"source":126,"transfer_id":0)",
       "1e00017e#525cfa0102030480 1e00017e#05060708090a0b20 1e00017e#0c0d0e0f1040"},
      {"uavcan.protocol.debug.LogMessage", R"({"level":{"value":2},"source":"esc","text":"hot"})",
       R"("kind":"message","priority":31,"source":42)", "1f3fff2a#43657363686f74c0"},
  };
  for (const Vector& v : vectors) EXPECT_EQ(frames_of(ask(encode_line(v.type, v.fields, v.more))), v.frames) << v.type << v.fields;
}

TEST(Adapter, Float16AtItsEdges) {
  struct Row {
    const char* value;
    const char* payload;  // frequency low byte first, then duration 0
  };
  for (const Row& row :
       {Row{"1", "003c0000"}, Row{"-2", "00c00000"}, Row{"65504", "ff7b0000"}, Row{"65519.9", "ff7b0000"}, Row{"65520", "ff7b0000"},
        Row{"1e300", "ff7b0000"}, Row{"-1e300", "fffb0000"}, Row{R"("inf")", "007c0000"}, Row{R"("-inf")", "00fc0000"},
        Row{R"("nan")", "ff7f0000"}, Row{R"("-0")", "00800000"}, Row{"0", "00000000"}, Row{"6.103515625e-5", "00040000"},
        Row{"5.9604644775390625e-8", "01000000"}, Row{"2.9802322387695312e-8", "01000000"}, Row{"2.98e-8", "00000000"},
        Row{"1.00048828125", "013c0000"}}) {  // a half rounds away from zero
    EXPECT_EQ(payload("uavcan.equipment.indication.BeepCommand", std::string(R"({"frequency":)") + row.value + "}"), row.payload)
        << row.value;
  }
}

TEST(Adapter, FloatsComeBackAsNumbersOrByName) {
  const Json a = ask(R"({"op":"decode","events":[{"t":0,"id":"1004380a","data":"007c0080c0"},{"t":0,"id":"1004380a","data":"ff7f003cc1"},
                        {"t":0,"id":"1004380a","data":"00fcff7bc2"}]})");
  ASSERT_EQ(a["transfers"].size(), 3u) << a;
  EXPECT_EQ(a["transfers"][0]["fields"].dump(), R"({"frequency":"inf","duration":"-0"})");
  EXPECT_EQ(a["transfers"][1]["fields"].dump(), R"({"frequency":"nan","duration":1.0})");
  EXPECT_EQ(a["transfers"][2]["fields"].dump(), R"({"frequency":"-inf","duration":65504.0})");
}

TEST(Adapter, IntegersSaturateOrAreTruncatedAsTheirDefinitionSaysHoweverLargeTheyAre) {
  EXPECT_EQ(payload("uavcan.protocol.NodeStatus", R"({"uptime_sec":99999999999,"health":7,"mode":1000,"sub_mode":-5})"), "fffffffff80000");
  EXPECT_EQ(payload("uavcan.protocol.GlobalTimeSync", R"({"previous_transmission_timestamp_usec":72057594037928194})"), "02010000000000");
  EXPECT_EQ(payload("uavcan.protocol.GlobalTimeSync", R"({"previous_transmission_timestamp_usec":-1})"), "ffffffffffffff");
  EXPECT_EQ(payload("uavcan.equipment.esc.RPMCommand", R"({"rpm":[1e40,-1e40,0]})"), "ffff4000200000");
  EXPECT_EQ(payload("uavcan.equipment.esc.RPMCommand", R"({"rpm":[18446744073709551615]})"), "ffff40");
}

TEST(Adapter, AbsentFieldsAreZeroEmptyOrTheFirstMember) {
  EXPECT_EQ(payload("uavcan.equipment.esc.RawCommand", "{}"), "");
  EXPECT_EQ(frames_of(ask(encode_line("uavcan.protocol.param.GetSet", R"({"index":3})", R"("kind":"request","source":1,"dest":2)"))),
            "100b8281#0300c0");
}

TEST(Adapter, UnionIsAnObjectWithTheActiveMemberAsItsOnlyKey) {
  const std::string more = R"("kind":"request","source":1,"dest":2)";
  const Json sent = ask(encode_line("uavcan.protocol.param.GetSet", R"({"value":{"real_value":1.5},"name":"abc"})", more));
  const Json a = ask(R"({"op":"decode","local_node":2,"events":[{"id":"100b8281","data":)" + sent["frames"][0]["data"].dump() +
                     R"(},{"id":"100b8281","data":)" + sent["frames"][1]["data"].dump() + "}]}");
  ASSERT_EQ(a["transfers"].size(), 1u) << a;
  EXPECT_EQ(a["transfers"][0]["kind"], "request");
  EXPECT_EQ(a["transfers"][0]["fields"].dump(), R"({"index":0,"value":{"real_value":1.5},"name":{"hex":"616263"}})");
  EXPECT_TRUE(ask(encode_line("uavcan.protocol.param.GetSet", R"({"value":{"real_value":1,"boolean_value":1}})", more)).contains("error"));
}

TEST(Adapter, CanFdHasLengthFieldsAndZerosUpToItsFrameLengths) {
  const std::string fd = R"("kind":"message","priority":7,"source":120,"canfd":true)";
  EXPECT_EQ(frames_of(ask(encode_line("uavcan.equipment.esc.RawCommand", R"({"cmd":[0,0,0,0]})", fd))),
            "07040678#2000000000000000000000c0");
  const Json a = ask(R"({"op":"decode","events":[{"id":"07040678","data":"2000000000000000000000c0","canfd":true}]})");
  EXPECT_EQ(a["transfers"][0]["fields"].dump(), R"({"cmd":[0,0,0,0]})");
}

TEST(Adapter, LocalNodeSelectsTheServicesAndMessagesAreForAll) {
  const std::string events = R"("events":[{"id":"1801aaf8","data":"c9"},{"id":"1401552a","data":"87d6120008efbec0"}]})";
  EXPECT_EQ(ask(R"({"op":"decode","local_node":42,)" + events)["transfers"].size(), 2u);
  EXPECT_EQ(ask(R"({"op":"decode","local_node":43,)" + events)["transfers"].size(), 1u);
}

std::string event(double t_s, const char* data, const char* id = "07040778") {
  return R"({"t":)" + std::to_string(t_s) + R"(,"id":")" + id + R"(","data":")" + data + R"(","extended":true,"canfd":false})";
}
std::size_t transfers(const std::vector<std::string>& events) {
  std::string line = R"({"op":"decode","local_node":1,"events":[)";
  for (const std::string& e : events) line += e + (&e == &events.back() ? "]}" : ",");
  return ask(line)["transfers"].size();
}

TEST(Adapter, ReassemblyFollowsTransferIdToggleCrcAndTheTimeOutOfTwoSeconds) {
  const char *first = "48dbf6223d888882", *last = "c231d37362";
  EXPECT_EQ(transfers({event(0, first), event(0.001, last)}), 1u);
  EXPECT_EQ(transfers({event(0, first), event(2.1, last)}), 0u) << "its start is older than 2 s";
  EXPECT_EQ(transfers({event(0, first), event(0.001, "c231d37342")}), 0u) << "toggle";
  EXPECT_EQ(transfers({event(0, first), event(0.001, "c231d37363")}), 0u) << "transfer id";
  EXPECT_EQ(transfers({event(0, first), event(0.001, "c231d37462")}), 0u) << "CRC";
  EXPECT_EQ(transfers({event(0, first), event(0.001, last), event(0.002, first), event(0.003, last)}), 1u) << "repeated";
  EXPECT_EQ(transfers({event(0, first), event(0.001, first, "07040779"), event(0.002, last, "07040779"), event(0.003, last)}), 2u)
      << "two sources interleaved";
  EXPECT_EQ(transfers({event(0, last), event(0.001, first), event(0.002, last)}), 1u);
}

TEST(Adapter, UnknownTypeIsSkippedAndEverythingMalformedIsAnErrorWithItsPlace) {
  EXPECT_TRUE(ask(encode_line("uavcan.equipment.air_data.TrueAirspeed", "{}")).contains("skip"));
  const char* bad[] = {
      "",
      "{",
      "[]",
      "17",
      "nul",
      "{}",
      R"({"op":"fly"})",
      R"({"op":"encode"})",
      R"({"op":"decode"})",
      R"({"op":"decode","events":{}})",
      R"({"op":"decode","events":[7]})",
      R"({"op":"decode","events":[{"id":"zz","data":""}]})",
      R"({"op":"decode","events":[{"id":"ffffffff","data":""}]})",
      R"({"op":"decode","events":[{"id":"1","data":"0"}]})",
      R"({"op":"decode","events":[{"id":"1","data":"001122334455667788"}]})",
      R"({"op":"decode","events":[{"id":"1","data":"00","t":-1}]})",
      R"({"op":"decode","events":[{"id":"1","data":"00112233445566778899","canfd":true}]})",
      R"({"op":"decode","local_node":200,"events":[]})",
      "\xff\xfe{\"op\":1}",
      R"({"op":"encode","kind":"message","type":"uavcan.protocol.GetNodeInfo","source":1})",
      R"({"op":"encode","kind":"message","type":"uavcan.protocol.NodeStatus","source":200})",
      R"({"op":"encode","kind":"message","type":"uavcan.protocol.NodeStatus","source":1,"priority":32})",
      R"({"op":"encode","kind":"message","type":"uavcan.protocol.NodeStatus","source":1,"fields":{"health":"bad"}})",
      R"({"op":"encode","kind":"message","type":"uavcan.protocol.NodeStatus","source":1,"fields":{"health":1.5}})",
      R"({"op":"encode","kind":"message","type":"uavcan.protocol.NodeStatus","source":1,"fields":{"heath":1}})",
      R"({"op":"encode","kind":"anonymous","type":"uavcan.protocol.dynamic_node_id.Allocation","fields":{"unique_id":{"hex":"00112233445566778899"}}})",
      R"({"op":"encode","kind":"request","type":"uavcan.protocol.GetNodeInfo","source":1,"dest":0})"};
  for (const char* line : bad) EXPECT_TRUE(ask(line).contains("error")) << line << " -> " << adapter_answer(line);
  const Json many = ask(encode_line("uavcan.equipment.esc.RawCommand", R"({"cmd":[0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0]})"));
  EXPECT_EQ(many["error"], "fields.cmd: 21 items, at most 20 fit");
  EXPECT_TRUE(ask(std::string(100'000, '[')).contains("error"));
}

// 10^5 lines, each a good one with a few bytes changed, cut out, put in, or spliced with another: whatever comes, there is one answer, on
// one line, and it is a JSON object with frames, transfers, a skip or an error. Seed 1; the counts show that good and bad lines were both
// among them.
TEST(Adapter, NeverDiesOfAMutatedLine) {
  const std::vector<std::string> good{
      encode_line("uavcan.protocol.NodeStatus", R"({"uptime_sec":7,"health":1,"vendor_specific_status_code":48879})"),
      encode_line("uavcan.equipment.esc.RawCommand", R"({"cmd":[0,8191,-8192,4096]})"),
      encode_line("uavcan.equipment.esc.Status", R"({"voltage":"nan","current":"-inf","temperature":1e300,"rpm":-8950,"esc_index":2})"),
      encode_line("uavcan.protocol.param.GetSet", R"({"value":{"real_value":1.5},"name":"status_Hz"})",
                  R"("kind":"request","source":127,"dest":42)"),
      encode_line("uavcan.protocol.file.Read", R"({"error":{"value":0},"data":{"hex":"deadbeef"}})",
                  R"("kind":"response","source":42,"dest":127,"canfd":true)"),
      R"({"op":"decode","local_node":42,"events":[{"t":0.1,"id":"1401552a","data":"87d6120008efbec0","extended":true,"canfd":false}]})",
      R"({"op":"decode","events":[{"t":0,"id":"10040a2a","data":"7967010000000083"},{"t":0,"id":"10040a2a","data":"4c00c1e45c0add23"},{"t":0,"id":"10040a2a","data":"c30843"}]})"};
  std::mt19937 random(1);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  const std::string special = "{}[]\":,.-+eE019nul\\ \t";
  std::size_t errors = 0, answered = 0;
  for (int i = 0; i < 100'000; ++i) {
    std::string line = good[below(good.size())];
    for (std::size_t change = below(4); change > 0 && !line.empty(); --change) {
      const std::size_t at = below(line.size());
      switch (below(5)) {
        case 0:
          line[at] = static_cast<char>(random() & 0xFF);
          break;
        case 1:
          line[at] = special[below(special.size())];
          break;
        case 2:
          line.erase(at, 1 + below(8));
          break;
        case 3:
          line.insert(at, 1 + below(40), special[below(special.size())]);
          break;
        default:
          line = line.substr(0, at) + good[below(good.size())].substr(at / 2);
      }
    }
    const std::string text = adapter_answer(line);
    ASSERT_EQ(text.find('\n'), std::string::npos) << line;
    const Json a = Json::parse(text, nullptr, false);
    ASSERT_TRUE(a.is_object()) << line << " -> " << text;
    const bool error = a.contains("error");
    ASSERT_TRUE(error || a.contains("frames") || a.contains("transfers") || a.contains("skip")) << line << " -> " << text;
    ++(error ? errors : answered);
  }
  EXPECT_GT(errors, 20'000u);
  EXPECT_GT(answered, 20'000u);
}

TEST(Adapter, TransferTooShortForItsTypeIsListedApart) {
  const Json a = ask(R"({"op":"decode","events":[{"id":"1401552a","data":"87d612c0"}]})");
  EXPECT_EQ(a["transfers"].size(), 0u);
  ASSERT_EQ(a["rejected"].size(), 1u);
  EXPECT_EQ(a["rejected"][0]["payload"], "87d612");
}

}  // namespace
}  // namespace rotorloop
