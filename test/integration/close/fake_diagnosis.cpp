// Replaces the diagnosis in the test of the loop: called like rotorloop, it scales the thrust model of the vehicle file that it was given,
// says that it found an effect, and tries to open every file that the test names with --pry, reporting which it could.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

namespace {

std::string text_of(const std::string& path) {
  std::ifstream in(path);
  std::ostringstream s;
  s << in.rdbuf();
  return s.str();
}

// Multiplies the number behind `key = { value = ` by `factor`.
void scale(std::string& text, const std::string& key, double factor) {
  const auto at = text.find("value = ", text.find(key)) + 8;
  const auto end = text.find_first_of(",} ", at);
  std::ostringstream number;
  number.precision(12);
  number << std::stod(text.substr(at, end - at)) * factor;
  text.replace(at, end - at, number.str());
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  std::string out, opened;
  std::size_t flights = 0, held_out = 0;
  double factor = 1.0;
  for (std::size_t i = 1; i + 1 < words.size(); ++i) {
    if (words[i] == "-o") out = words[i + 1];
    if (words[i] == "--factor") factor = std::stod(words[i + 1]);
    if (words[i] == "--flight") flights += std::filesystem::is_regular_file(words[i + 1]) ? 1 : 0;
    if (words[i] == "--held-out") held_out += std::filesystem::is_regular_file(words[i + 1]) ? 1 : 0;
    if (words[i] == "--pry" && std::ifstream(words[i + 1]).good()) opened += words[i + 1] + " ";
  }
  std::cerr << words[0] << " with " << flights << " flights, " << held_out << " held out\n";
  if (flights == 0 || held_out == 0) return 5;
  std::string vehicle = text_of("vehicle.toml");
  scale(vehicle, "k1_N_s2 =", factor);
  scale(vehicle, "k2_N_s2_m =", factor);
  std::ofstream(out) << vehicle;
  if (words[0] == "diagnose")
    std::ofstream("out/report/result.json")
        << R"({"format":1,"verdict":"named","added":[{"id":"blockage_strut","parameters":[{"name":"loss","unit":"1","value":)"
        << 1.0 - factor << R"(,"u":0.005}],"twins":[]}],"remarks":["opened: )" << opened << R"("]})";
  return 0;
}
