// What every drawing of a page is made of: text that XML accepts, coordinates, ticks. Shared by line plots and field maps, so
// that they look alike.
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace rotorloop::render {

// Colours are numbers into a palette that colour-blind readers can distinguish (Okabe and Ito), the same in every plot of a
// page: one thing, one colour. kNeutral is the text colour, for what is wanted rather than measured.
inline constexpr int kNeutral = -1;
inline constexpr int kPaletteSize = 6;

std::string xml_escaped(std::string_view text);

// About `wanted` ticks at multiples of 1, 2 or 5 times a power of ten within [low, high]; low < high.
struct Ticks {
  std::vector<double> at;
  int decimals = 0;
  bool decades = false;  // `at` are logarithms to base ten
};
Ticks nice_ticks(double low, double high, int wanted);
// Of a logarithmic axis, `low` and `high` as powers of ten: decades, with twos and fives between where there is room for them.
Ticks decade_ticks(double low, double high, int wanted);
std::string tick_text(double value, int decimals);  // with a true minus sign
std::string tick_text(double at, const Ticks& ticks);

// A coordinate with one decimal: a tenth of a pixel is below what is seen.
std::string px(double value);
double text_px(std::string_view text);  // width at the font size of the style sheet, estimated
std::string open_svg(int width_px, double height_px, const std::string& title);

}  // namespace rotorloop::render
