#include "bench/sysid/diagnose/report/diagnosis_outcome.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace rotorloop::diagnose {
namespace {

// What a person does about the effects, each with its size: "weak_rotor (rotor 3 (front left) 5.1 %): look at …".
std::string to_mend(const Diagnosis& d) {
  std::string out;
  for (const AddedEffect& a : d.added) {
    if (a.next.empty()) continue;
    out += (out.empty() ? "" : "; ") + a.id + (a.in_words.empty() ? "" : " (" + a.in_words + ")") + ": " + a.next;
  }
  return out;
}

std::string next_step(const Diagnosis& d) {
  switch (d.verdict) {
    case DiagnosisVerdict::clean:
      return "fly with the vehicle file as it is; what these flights could not have shown stands at the end";
    case DiagnosisVerdict::named:
      if (const std::string mend = to_mend(d); !mend.empty()) return mend + "; else write it to a file (-o FILE) and fly with that";
      return "write the vehicle file with the effect (-o FILE) and fly with it: rotorloop hil SCENARIO --vehicle FILE";
    case DiagnosisVerdict::ambiguous: {
      const auto open = std::find_if(d.added.begin(), d.added.end(), [](const AddedEffect& a) { return !a.manoeuvre.empty(); });
      return open == d.added.end() ? "fly with any of the class, or measure which one it is"
                                   : "fly what distinguishes them: " + open->manoeuvre;
    }
    case DiagnosisVerdict::unexplained:
      return "look at what the residuals say; a term of your own can be tried with --library (docs/own_terms.md)";
    case DiagnosisVerdict::faulty:
      return "mend the sensor or stream that is named, and fly again";
    case DiagnosisVerdict::incomplete:
      return "run the same command again with --force: nothing of it is taken over";
  }
  return "";
}

}  // namespace

std::string verdict_words(const std::string& verdict) {
  if (verdict == "clean") return "clean: these flights show nothing that the model lacks";
  if (verdict == "named") return "named: the model lacks what stands below";
  if (verdict == "ambiguous")
    return "ambiguous: the model lacks what stands below; these flights cannot distinguish all of it from its aliases";
  if (verdict == "unexplained") return "unexplained: the residual is real, and no effect of the library explains it";
  if (verdict == "incomplete") return "incomplete: stopped before its end; what stands below was found before";
  return "faulty: a sensor or the log is at fault; no physics was fitted to it";
}

render::Outcome diagnosis_outcome(const Diagnosis& d, const identify::IdentifyProvenance& p) {
  if (p.ended) return *p.ended;
  render::Outcome out{.verdict = std::string(name(d.verdict))};
  const bool settled = d.not_judged.empty() && (d.verdict == DiagnosisVerdict::clean || d.verdict == DiagnosisVerdict::named);
  out.standing = settled ? render::Standing::good : d.verdict == DiagnosisVerdict::faulty ? render::Standing::bad : render::Standing::open;
  const std::string words = verdict_words(out.verdict);
  out.sentence = words.substr(words.find(": ") + 2) + (!d.added.empty() && !d.remains.empty() ? "; and something remains" : "");
  out.sentence += d.not_judged.empty() ? "." : fmt::format("; not judged: {}.", fmt::join(d.not_judged, ", "));
  if (d.verdict == DiagnosisVerdict::faulty)
    for (const LogFault& f : d.faults) out.errors.push_back(f.flight + (f.stream.empty() ? "" : " " + f.stream) + ": " + f.what);
  if (d.verdict == DiagnosisVerdict::incomplete && !d.remarks.empty()) out.errors.push_back(d.remarks.front());
  out.next = next_step(d);
  return out;
}

}  // namespace rotorloop::diagnose
