#include <fmt/format.h>
#pragma GCC diagnostic ignored "-Wconversion"
#include <cmath>
#include "bench/identify/checks.hpp"
#include "bench/identify/flight_motion.hpp"
#include "bench/identify/stream_reader.hpp"
#include "test/unit/bench/identify/measured_fit.hpp"
namespace rotorloop::bench {
namespace {
const MeasuredSet kPayload{"imrc_cf21bl_payload"};
TEST(Explore, pendulum) {
  host::TermList terms; terms.add(*host::find_term("slung_load"));
  for (const char* stem : {"eckart17","eckart29","eckart43", "eckart45", "eckart62","eckart63", "eckart67","eckart68", "eckart82","eckart83"}) {
    const CheckedFlight c = check_flight(kPayload.flight(stem), host::to_model(kPayload.vehicle()));
    if (c.refusal) { fmt::print("{} refused {}\n", stem, c.refusal->what); continue; }
    GridOptions o; o.rate_Hz = 100; o.use_gyro = o.use_accel = true;
    GridFlight g = make_grid(c.flight, o);
    ModelValues v = model_values(host::to_model(kPayload.vehicle()), terms);
    v[kK1] = 3.7e-8; v[kK2] = 0; v[kCdh] = 0.03;
    const auto states = states_by_readings(g, v, {});
    const FlightRecord full = kPayload.flight(stem);
    auto ex = [&](const char* n) -> const Stream<double>& { return full.extra.at(n); };
    StreamReader<double> px(ex("payload_x[m]")), py(ex("payload_y[m]")), pz(ex("payload_z[m]"));
    std::vector<Eigen::Vector3d> d(g.knots);
    double len=0, len2=0;
    for (std::size_t k=0;k<g.knots;++k){ double t=g.time_s(k); d[k]=Eigen::Vector3d(px.at(t),py.at(t),pz.at(t))-states[k].p_W_m; double L=d[k].norm(); len+=L;len2+=L*L; d[k]/=L; }
    len/=g.knots; len2=std::sqrt(std::max(0.0,len2/g.knots-len*len));
    g.input.follow(std::make_shared<const Motion>(motion_of(g, states)));
    const int P=kCoreParameters;
    std::vector<int> par{P+1,P+2}; for(int i=0;i<4;++i) par.push_back(start_parameter(i,terms));
    v[P+1]=0.518; v[P+2]=0.02;
    v[par[2]]=d[0].x(); v[par[3]]=d[0].y(); v[par[4]]=(d[5].x()-d[0].x())/0.05; v[par[5]]=(d[5].y()-d[0].y())/0.05;
    double rms=0, first=0;
    for(int it=0;it<12;++it){
      RotorInput in=g.input; in.prepare(v); std::size_t hint=0;
      Eigen::MatrixXd J(2*g.knots,6); Eigen::VectorXd r(2*g.knots); J.setZero();
      for (std::size_t k=0;k<g.knots;++k){ auto u=in.at(g.time_s(k),hint,false);
        for(int a=0;a<2;++a) r[2*k+a]=d[k][a]-u.memory[a];
        for(int j=0;j<6;++j) u.memory_input->derivatives(u.memory_row,u.memory_share,par[j],[&](std::size_t i,double by){ if(i<2) J(2*k+i,j)=by; }); }
      rms=std::sqrt(r.squaredNorm()/r.size()); if(it==0) first=rms;
      Eigen::VectorXd step=J.colPivHouseholderQr().solve(r);
      for(int j=0;j<6;++j) v[par[j]]+=step[j];
      v[P+1]=std::clamp(v[P+1],0.2,1.5); v[P+2]=std::clamp(v[P+2],0.0,0.4);
    }
    double vmax=0; for(auto&s:states) vmax=std::max(vmax,s.v_W_m_s.norm());
    double sx=0,sy=0; for(auto&q:d){sx+=q.x()*q.x();sy+=q.y()*q.y();}
    fmt::print("{} {:.1f} s, segments {}, measured L {:.3f}±{:.3f}; rms d {:.3f} {:.3f}; first {:.4f} fitted {:.4f}: L {:.3f} zeta {:.4f} vmax {:.2f}; dt pay {} late\n", stem, g.knots*g.step_s, c.segments.size(), len,len2,std::sqrt(sx/g.knots),std::sqrt(sy/g.knots),first,rms,v[P+1],v[P+2],vmax, full.extra.at("payload_x[m]").size());
  }
}
}}
