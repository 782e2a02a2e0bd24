use super::*;
use crate::linalg::white;

#[test]
fn place_holder() {
    let settings = BankSettings { errors: true, ..BankSettings::default() };
    let mut bank = Bank::new(1, 1, 3, &settings).expect("a sound bank");
    let (u, e) = (white(300, 1), white(300, 2));
    let mut y = vec![0.0; 300];
    for t in 2..300 {
        y[t] = 0.8 * y[t - 1] + 0.5 * u[t - 2] + 0.1 + 0.01 * e[t];
    }
    bank.run(&u, &y).expect("sound rows");
    for k in 0..3 {
        println!("{:?} {:?} {} {}", bank.theta(0, k), bank.sd(0, k), bank.eps(0, k), bank.s2(0, k));
    }
    let mut many = Bank::new(50, 1, 3, &settings).expect("a sound bank");
    for t in 0..300 {
        many.step(&[u[t]; 50], &[y[t]; 50]).expect("sound");
    }
    for k in 0..3 {
        assert_eq!((many.theta(41, k), many.s2(41, k)), (bank.theta(0, k), bank.s2(0, k)));
    }
}
