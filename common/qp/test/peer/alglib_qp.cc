#include "common/qp/test/peer/alglib_qp.h"

#include <optimization.h>

namespace mimesis::qp {
namespace {

alglib::real_1d_array vector(const Eigen::Ref<const Eigen::VectorXd>& v) {
  alglib::real_1d_array out;
  out.setcontent(v.size(), v.data());
  return out;
}

}  // namespace

Eigen::VectorXd alglib_minimum(const Problem& problem, double precision) {
  const auto n = problem.g.size(), m = problem.A.rows();
  const Eigen::MatrixXd H = problem.H;
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> A = problem.A;
  alglib::real_2d_array quadratic, rows;
  quadratic.setcontent(n, n, H.data());
  rows.setcontent(m, n, A.data());
  alglib::minqpstate state;
  alglib::minqpcreate(n, state);
  alglib::minqpsetquadraticterm(state, quadratic);
  alglib::minqpsetlinearterm(state, vector(problem.g));
  if (problem.x_lower.size() > 0) {
    alglib::minqpsetbc(state, vector(problem.x_lower), vector(problem.x_upper));
  }
  if (m > 0) {
    alglib::minqpsetlc2dense(state, rows, vector(problem.lower), vector(problem.upper));
  }
  alglib::minqpsetalgodenseipm(state, precision);
  alglib::minqpoptimize(state);
  alglib::real_1d_array x;
  alglib::minqpreport report;
  alglib::minqpresults(state, x, report);
  if (report.terminationtype <= 0) return {};
  return Eigen::Map<Eigen::VectorXd>(x.getcontent(), n);
}

}  // namespace mimesis::qp
