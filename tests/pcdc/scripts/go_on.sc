# Takes up bar.sc at its first checkpoint.
pcdc model restore 'half.sav'
pcdc model solve time 2e-5
m_report('second')
pcdc model save 'end.sav'
