#include "bench/render/page.hpp"

#include <fmt/format.h>

#include "bench/render/svg_plot.hpp"

namespace rotorloop::render {
namespace {
constexpr std::string_view kPageCss =
    R"(*{box-sizing:border-box}body{margin:0;background:var(--paper);color:var(--ink);font:15px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,"DejaVu Sans",sans-serif}
main{max-width:1200px;margin:0 auto;padding:36px 28px 72px}h1{font-size:27px;line-height:1.2;margin:0 0 4px;letter-spacing:-.01em}h2{font-size:19px;margin:52px 0 6px;padding-top:18px;border-top:1px solid var(--line)}h3{font-size:15px;margin:30px 0 4px}
p{margin:6px 0 14px;max-width:80ch}li{overflow-wrap:anywhere}.sub{color:var(--soft);margin:0 0 22px}.cap{color:var(--soft);font-size:13px;margin:2px 0 10px;max-width:100ch}
.verdict{display:flex;flex-wrap:wrap;gap:8px 22px;align-items:center;border:1px solid var(--line);border-left:6px solid var(--soft);background:var(--raise);border-radius:8px;padding:18px 22px;margin:0 0 18px}
.verdict>b{font-size:25px;letter-spacing:.05em;text-transform:uppercase}.verdict>div{flex:1 1 260px;min-width:0;overflow-wrap:anywhere}.verdict p{margin:0}.verdict ul{margin:6px 0;padding-left:20px}.verdict .next{margin-top:6px;font-weight:600}
.pass{border-left-color:var(--good)}.pass>b,td.pass{color:var(--good)}.fail{border-left-color:var(--alarm)}.fail>b,td.fail{color:var(--alarm)}.incomplete{border-left-color:var(--wait)}.incomplete>b{color:var(--wait)}
.facts{display:flex;flex-wrap:wrap;gap:10px 34px;margin:0 0 18px}.facts div{font-variant-numeric:tabular-nums}.facts span{display:block;color:var(--soft);font-size:12.5px}
.warn{border:1px solid var(--line);border-left:6px solid var(--wait);background:var(--raise);border-radius:8px;padding:10px 20px 10px 38px;margin:0 0 18px}.warn li{margin:4px 0}
.scroll{overflow-x:auto;background:linear-gradient(to right,var(--paper) 40%,transparent),linear-gradient(to left,var(--paper) 40%,transparent) 100% 0,linear-gradient(to right,var(--edge),transparent),linear-gradient(to left,var(--edge),transparent) 100% 0;background-repeat:no-repeat;background-size:28px 100%,28px 100%,9px 100%,9px 100%;background-attachment:local,local,scroll,scroll}
table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:14px;margin:10px 0 18px;min-width:60%}
th{font-weight:600;text-align:right;color:var(--soft);font-size:12.5px;vertical-align:bottom;padding:6px 11px 6px 0;border-bottom:1px solid var(--edge);white-space:nowrap}
td{text-align:right;padding:6px 11px 6px 0;border-bottom:1px solid var(--line);white-space:nowrap}th.l,td.l{text-align:left}td.l{white-space:normal}td.hash{overflow-wrap:anywhere;min-width:16em}td+td.l,th+th.l{padding-left:12px}tr.first td{border-top:1px solid var(--edge)}td.big{font-weight:650;font-size:15px}
.dot{display:inline-block;width:10px;height:10px;border-radius:3px;margin-right:8px}.b0{background:var(--c0)}.b1{background:var(--c1)}.b2{background:var(--c2)}.b3{background:var(--c3)}.b4{background:var(--c4)}.b5{background:var(--c5)}
.verdict p{max-width:none}.two{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(440px,100%),1fr));gap:6px 24px}.two figure,.views figure{margin:4px 0 8px}.views{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(300px,100%),1fr));gap:14px}figure{margin:8px 0 22px}figcaption{color:var(--soft);font-size:13px;margin:2px 0 6px}
code,pre,.hash{font:12.5px/1.5 ui-monospace,"SF Mono",Menlo,Consolas,"DejaVu Sans Mono",monospace}pre{background:var(--raise);border:1px solid var(--line);border-radius:6px;padding:12px 16px;overflow-x:auto;margin:8px 0 18px}.hash{color:var(--soft)}
nav{margin:0 0 22px;font-size:14px}nav a{color:var(--c1);text-decoration:none;margin-right:18px}nav a:hover{text-decoration:underline}
@media(max-width:1200px){th{white-space:normal}table{font-size:13px}th,td{padding-right:5px}td+td.l,th+th.l{padding-left:5px}}
@media(max-width:640px){main{padding:20px 14px 48px}h1{font-size:22px}h1,h2,.sub,.facts div{overflow-wrap:anywhere}.verdict{padding:12px 14px}nav a{display:inline-block}table{font-size:12px;min-width:0}th{font-size:11px}th,td{padding-right:6px}td.l{min-width:4em}td.big{font-size:12.5px}}
@media print{main{max-width:none;padding:0}h2{break-after:avoid}figure{break-inside:avoid}nav{display:none}}
)";
}  // namespace

std::string page_begin(const std::string& title, const std::string& subtitle, const std::string& tab) {
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
         "content=\"width=device-width,initial-scale=1\"><meta name=\"color-scheme\" content=\"light dark\">\n<title>" +
         xml_escaped(title) + " – " + xml_escaped(tab) + "</title>\n<style>\n" + std::string(plot_css()) + std::string(kPageCss) +
         "</style></head><body><main>\n<h1>" + xml_escaped(title) + "</h1>\n<p class=\"sub\">" + xml_escaped(subtitle) + "</p>\n";
}

std::string page_end() { return "</main></body></html>\n"; }

std::string figure_html(const std::string& caption, const std::string& svg) {
  return "<figure>" + (caption.empty() ? "" : "<figcaption>" + caption + "</figcaption>") + "\n" + svg + "</figure>\n";
}

std::string facts_html(const std::vector<std::pair<std::string, std::string>>& facts) {
  if (facts.empty()) return "";
  std::string out = "<div class=\"facts\">";
  for (const auto& [name, value] : facts) out += fmt::format("<div><span>{}</span>{}</div>", xml_escaped(name), xml_escaped(value));
  return out + "</div>\n";
}

}  // namespace rotorloop::render
